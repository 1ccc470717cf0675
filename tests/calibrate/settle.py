# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws what hides in a rig and brings it to a strength with at most three fits: of the clean rig, of a guess, of the guess scaled."""

import json
import math
import os
import random
import shutil

import effects
import records
import rigs

# kind, share, (weakest, strongest) goal in times what the rig leaves without the effect
BAD_FIT = 0.15  # a fit that leaves so much without a search has ended in a wrong minimum more often than not
STRONGEST = 150  # times the noise of a strong effect, unless the clean rig leaves a tenth of that or more
KINDS = (("clean", 12, None), ("plain", 55, (4, 40)), ("subtle", 20, (1.4, 2.8)), ("pair", 8, (4, 40)), ("outside", 5, (2.5, 20)))
PLAIN, FAINT = 3.2, 1.15  # times clean_ratio: plain above, subtle between, faint (nobody can see it) below
CHANGED = 0.3  # nrmse of a fit without the cause, from which a change is as large as laboratories make them
ROUGH, MOST = (0.02, 0.2), 0.8  # nrmse that a rough rig's fit leaves without the cause, and most of what one with it should
FIT_LIMIT_S = 60
GROWN = 1e9  # SI: larger numbers are no motion of a beam, but of one that an effect has made unstable
TRIALS = 3  # effects that are tried on a rig before it is given up


def train(rig):
    return [name for name in rig.records if name.startswith("train")]


def fit(program, directory, names, model="model.yaml", limit_s=FIT_LIMIT_S, check=(), more=("--no-search",)):
    """(answer or None, message, seconds)"""
    command = [program, "fit", os.path.join(directory, model)] + [os.path.join(directory, n + ".csv") for n in names]
    command += ["-o", os.path.join(directory, "fitted.yaml"), "--force", "--json"] + list(more)
    command += ["--check"] + [os.path.join(directory, n + ".csv") for n in check] if check else []
    status, out, err, seconds = records.run(command, limit_s)
    try:
        return (json.loads(out), "", seconds) if status == 0 else (None, "fit: %s" % (err.strip() or "more than %g s" % limit_s), seconds)
    except json.JSONDecodeError:
        return None, "fit: not JSON", seconds


def write(rig, names, hidden, tools, raw, directory, probes=False):
    """Simulates and spoils the records; {record: exact channels} and a message."""
    exact = {}
    for name in names:
        outputs = rig.channels(name)[1]
        more = [line for effect in hidden for line in effect.lines(name, outputs)]
        if probes:
            places = sorted({effect.at for effect in probes})
            more += ["output probe_w%d displacement at_m=%.9g" % (k, at) for k, at in enumerate(places)]
            more += ["output probe_v%d velocity at_m=%.9g" % (k, at) for k, at in enumerate(places)]
            more += ["output probe_s patch_strain"]
        exact[name], message = records.simulate(rig, name, more, tools["truth"], raw)
        if exact[name] is None:
            return None, message
    os.makedirs(directory, exist_ok=True)
    records.write_text(os.path.join(directory, "model.yaml"), rig.model())
    reference = records.references(rig, {name: exact[name] for name in names if name.startswith("train")})
    for name in names:
        records.write_record(rig, name, exact[name], reference, directory)
    return exact, ""


def look(rig, exact, hidden):
    """What the clean records say of the motion, for each effect: see effects.first_guess."""
    peak = lambda name: max(max(map(abs, columns[name])) for columns in exact.values())
    places = sorted({effect.at for effect in hidden})
    channels = {"in": {}, "out": {}}
    for group, names in (("in", rig.inputs), ("out", rig.outputs)):
        for name in names:
            columns = [c[name] for c in exact.values() if name in c]
            if columns:
                channels[group][name] = (math.sqrt(sum(records.rms(c) ** 2 for c in columns) / len(columns)), max(max(map(abs, c)) for c in columns))
    found = []
    for effect in hidden:
        k = places.index(effect.at)
        found.append({"w": peak("probe_w%d" % k), "v": peak("probe_v%d" % k), "s": peak("probe_s") / rig.Ks, **channels})
    return found


def draw_effects(rig, kind, dice):
    """Objects of what hides; places and channels drawn, strengths not yet."""
    if kind == "clean":
        return []
    able = [effect for effect in effects.OUTSIDE + effects.CATALOGUE if effects.can_act(effect, rig)
            and (kind == "outside") == (effect in effects.OUTSIDE or effects.out_of_reach(effect, rig))]
    if kind == "changed":
        able = [effect for effect in effects.CHANGES if effects.can_change(effect, rig)]
    chosen = [dice.choice(able)]
    while kind == "pair" and len(chosen) < 2:
        other = dice.choice(able)
        if not any(other in family and chosen[0] in family for family in effects.FAMILIES) and other != chosen[0]:
            chosen.append(other)
    return [effects.Effect(effect, rig, dice) for effect in chosen]


def draw_beside(rig, hidden, dice):
    """Objects of what a rough rig lacks beside the cause: one or two, none of its kin."""
    kin = {effect.id for effect in hidden}
    kin |= {id for family in effects.FAMILIES for id in family if kin & set(family)}
    able = [effect for effect in effects.BESIDE if effect not in kin and effects.can_act(effect, rig)]
    chosen = {dice.choice(able) for _ in range(dice.choice((1, 2)))} if rig.rough and hidden else set()
    return [effects.Effect(effect, rig, dice) for effect in sorted(chosen)]


def noise_ratio(answer):
    return float(answer["noise_ratio"]) if answer and answer.get("noise_ratio") is not None else math.nan


class Refused(Exception):
    """This effect cannot be simulated or fitted on this rig."""


def measure(rig, hidden, tools, work, stage, probes=None):
    """Training records with the effects, fitted by the handbook model: (ratio, nrmse, exact channels)."""
    directory = os.path.join(work, "records")
    exact, message = write(rig, train(rig), hidden, tools, os.path.join(work, stage), directory, probes)
    if exact is None:
        raise Refused(message)
    if max(max(map(abs, column)) for columns in exact.values() for column in columns.values()) > GROWN:
        raise Refused("not stable")
    answer, message, _ = fit(tools["beamfit"], directory, train(rig))
    if answer and (answer["nrmse"] or 1) > BAD_FIT:
        again, _, _ = fit(tools["beamfit"], directory, train(rig), more=())
        answer = again if again and (again["nrmse"] or 1) < (answer["nrmse"] or 1) else answer
    if not noise_ratio(answer) > 0:
        raise Refused(message or "fit: no ratio")
    return noise_ratio(answer), float(answer["nrmse"]), exact


def scaled(rig, own, others, factor, tools, work, stage):
    """measure() with `own` effects so many times as strong, beside others."""
    if own[0].inverse and "level" in own[0].strength[0]:  # what saturates answers a high power of its level
        factor = factor ** 0.35
    for effect in own:
        effect.scale(factor)
    return measure(rig, others + own, tools, work, stage)


def roughen(rig, beside, dice, tools, work):
    """Brings what is there beside the cause to its share of the signal; (ratio, nrmse)."""
    wanted = rigs.log_uniform(dice, *ROUGH)
    ratio, nrmse, _ = measure(rig, beside, tools, work, "raw_guess")
    if not 0.7 * wanted < nrmse < 1.4 * wanted:
        ratio, nrmse, _ = scaled(rig, beside, [], max(0.05, min(20, wanted / nrmse)), tools, work, "raw_scaled")
    if not ROUGH[0] / 2 < nrmse < 1.5 * ROUGH[1]:
        raise Refused("rough by %.3g" % nrmse)
    return ratio, nrmse


def strength(rig, hidden, beside, goal, dice, tools, work):
    """The ratios of a case; hidden ends at the settled strength, the records on disk are those."""
    clean, clean_nrmse, exact = measure(rig, [], tools, work, "raw_clean", beside + hidden)
    for effect, seen in zip(beside + hidden, look(rig, exact, beside + hidden)):
        effects.first_guess(effect, rig, dice, seen)
    if beside:
        clean, clean_nrmse = roughen(rig, beside, dice, tools, work)
    found = {"clean_ratio": clean, "clean_nrmse": clean_nrmse, "ratio": clean, "nrmse": clean_nrmse}
    if not hidden:
        return found
    if goal is None:
        return changed(rig, hidden, beside, found, dice, tools, work)
    floor = max(clean, 1.0)
    low, high = goal[0], min(goal[1], max(1.5 * goal[0], STRONGEST / floor))
    high = min(high, max(low, MOST / clean_nrmse)) if beside else high
    wanted = math.sqrt(rigs.log_uniform(dice, low, high) ** 2 - 1) * floor
    ratio, nrmse, _ = measure(rig, beside + hidden, tools, work, "raw_guess")
    if not low <= ratio / floor <= high:
        own = math.sqrt(max(ratio ** 2 - clean ** 2, (0.1 * floor) ** 2))
        ratio, nrmse, _ = scaled(rig, hidden, beside, max(0.05, min(20, wanted / own)), tools, work, "raw_scaled")
    found.update(ratio=ratio, nrmse=nrmse)
    return found


def changed(rig, hidden, beside, found, dice, tools, work):
    """As strength(), of a change that is drawn as it is made, not brought to a goal."""
    for effect in hidden:
        effects.change(effect, dice)
    ratio, nrmse, _ = measure(rig, beside + hidden, tools, work, "raw_guess")
    if nrmse < CHANGED:
        raise Refused("a change that leaves %.3g" % nrmse)
    return {**found, "ratio": ratio, "nrmse": nrmse}


def landed(kind, found):
    """The kind by what the strength came to."""
    times = found["ratio"] / max(found["clean_ratio"], 1.0)
    if kind == "clean":
        return kind
    if times < FAINT:
        return "faint"
    return ("plain" if times >= PLAIN else "subtle") if kind in ("plain", "subtle") else kind


def describe(rig, kind, hidden, beside, found):
    """The truth as stored. What is there beside the cause counts as the rig's own error."""
    truth = [effect.id for effect in hidden]
    places = {effect.id: effect.values.get("at_m") for effect in hidden if "at_m" in effect.values}
    known = kind != "clean" and not set(truth) & (set(effects.OUTSIDE) - set(effects.SINCE))
    kind = "plain" if kind == "outside" and set(truth) <= set(effects.SINCE) else kind
    return {"case": rig.name, "kind": kind, "truth": truth, "right": effects.mates(truth, rig, places) if known else [],
            "also_true": sorted(set(rig.also_true()) | {e.id for e in beside} | ({"sensor_offset"} if rig.shift else set())), "removed": effects.removed(truth) if known and kind != "outside" else [],
            "effects": [{"id": e.id, "channel": e.channel, "bent": e.bent, "values": e.values} for e in hidden],
            "beside": [{"id": e.id, "values": e.values} for e in beside], "shifted": len(rig.shift), **found,
            "rig": {"support": rig.support, "material": rig.material, "length_m": rig.length_m, "modes": rig.modes, "rate_Hz": rig.rate_Hz,
                    "samples": rig.samples, "patches": len(rig.patches), "records": len(rig.records), "checks": len(rig.records) - len(train(rig)),
                    "outputs": len(rig.outputs), "decays": any(p["decay"] for p in rig.records.values()), "bits": rig.bits,
                    "filter_stated": rig.filter_stated, "weighed": rig.weighed, "care": rig.care, "uneven": len(rig.pieces) > 0, "one_level": rig.one_level,
                    "noise": {n: "%s %.4g of %s" % (v["colour"], v["level"], v["of"]) for n, v in rig.noise.items()}}}


def make_case(seed, number, tools, work, kind=None):
    """Draws case number of a seed below work, of a kind if one is given; its description, from case.json when this generator has made it before."""
    rig = rigs.Rig(seed, number)
    directory = os.path.join(work, rig.name)
    path = os.path.join(directory, "case.json")
    if os.path.exists(path):
        with open(path, encoding="utf-8") as stream:
            known = json.load(stream)
        if known["source"] == tools["source"]:
            return known, directory
        shutil.rmtree(directory)
    dice = random.Random("beamfit hides %d %d" % (seed, number))
    drawn = dice.choices([k for k, _, _ in KINDS], [share for _, share, _ in KINDS])[0]
    kind = kind or drawn
    goal, messages, case = {k: g for k, _, g in KINDS}.get(kind), [], None
    for trial in range(TRIALS):
        hidden = draw_effects(rig, kind, dice)
        beside = draw_beside(rig, hidden, dice)
        try:
            found = strength(rig, hidden, beside, goal, dice, tools, directory)
            if landed(kind, found) == "faint" and trial + 1 < TRIALS:
                raise Refused("faint")
            exact, message = write(rig, list(rig.records), beside + hidden, tools, os.path.join(directory, "raw"), os.path.join(directory, "records"))
            if exact is None:
                raise Refused(message)
            case = describe(rig, landed(kind, found), hidden, beside, found)
            break
        except Refused as refused:
            messages.append("%s: %s" % ("+".join(e.id for e in hidden) or "clean", refused))
    case = case or {"case": rig.name, "kind": "refused"}
    case.update(source=tools["source"], refused=messages)
    records.write_text(path, json.dumps(case, indent=1))
    for name in ("raw", "raw_clean", "raw_guess", "raw_scaled"):
        shutil.rmtree(os.path.join(directory, name), ignore_errors=True)
    return case, directory
