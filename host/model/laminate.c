/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "laminate.h"

/* About the middle of the beam's own thickness; the laminate's neutral axis lies `shift` away from it. */
double laminate_EI(const struct layer *beam, const struct layer *patch, int sides)
{
    double h = beam->thickness_m, t = patch->thickness_m, z = 0.5 * (h + t);
    double EA_beam = beam->E_Pa * beam->width_m * h, EA_patch = sides * patch->E_Pa * patch->width_m * t;
    double own = EA_beam * h * h / 12.0 + EA_patch * t * t / 12.0; /* Σ E w h³/12 */
    double shift = sides == 1 ? EA_patch * z / (EA_beam + EA_patch) : 0.0;
    return own + EA_patch * z * z - (EA_beam + EA_patch) * shift * shift; /* Steiner; for 2 sides eq. 30 */
}

double laminate_rho(const struct layer *beam, const struct layer *patch, int sides)
{
    return beam->density_kgpm3 * beam->width_m * beam->thickness_m +
           sides * patch->density_kgpm3 * patch->width_m * patch->thickness_m; /* eq. 31 */
}
