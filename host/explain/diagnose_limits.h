/* SPDX-License-Identifier: GPL-3.0-or-later */
/* diagnose_limits.h — what the search of a diagnosis means by much and little, alike and far; private to explain/. */
#ifndef BEAMFIT_DIAGNOSE_LIMITS_H
#define BEAMFIT_DIAGNOSE_LIMITS_H

/*
 * The words in which the rules of the search are told (docs/diagnose_search.md), each with one value everywhere. They say what is looked for next and what is left
 * alone; what is named is decided by probabilities (diagnose_decide.c). Two are asked there, too: `more`, whether a special case does as well as what was found
 * (diagnose_simplest.c), and `answer`, whether a nonlinear explanation is let off with the floor (diagnose_features.c).
 */
extern const struct search_limits {
    /* Of a misfit's power, of χ²/n, or of a score that stands for one of them. */
    double half;       /* what takes it leads: of two causes the stronger one does */
    double nearly_all; /* what takes it leaves little for anything else */
    double answer;     /* what takes it is the answer of a measured beam, which is never exact */
    double fifth;      /* what differs by less takes as much, what leaves no more leaves little */
    double tenth;      /* less is little */
    double hundredth;  /* less is next to nothing */
    double thousandth; /* less is nothing */
    /* Times an rms. */
    double mate;  /* what leaves no more does as well: class mates are told from each other above (docs/hidden.md) */
    double same;  /* likewise, where one of them is a fit that may have ended a little above its least */
    double alike; /* likewise, where the level of the noise is doubtful, too */
    double more;  /* what leaves no more comes near */
    double
        far; /* what leaves more is far off, from the noise or from the best: there one effect does not imitate another */
} search_limits;

/* Evaluations of a refit: one prediction of all records with its derivatives each. */
enum {
    QUICK_RUNS = 100, /* an effect that is there has been found by then (20 to 100); another goes on for hundreds */
    OWN_RUNS = 200,   /* the same, with a value in each record: a stiff spring at four places needs more than 100 */
    PLACE_RUNS = 40   /* of a law from a start near its place */
};

/* How many are refitted, at most. */
enum {
    SEARCH_LEADERS = 2, /* of what a look has brought farthest, to their ends */
    SEARCH_RIVALS = 3,  /* of what is held against each other */
    SEARCH_FEW = 4      /* of what takes a refit from nearby */
};

/* Places along the span, from the root: the tip has an effect of its own. */
enum { SIXTHS = 6 };

#endif
