# SPDX-License-Identifier: GPL-3.0-or-later
"""The measured beams: which files of ../shared/data/real become records, and what is known of each (docs/real_data.md)."""

import dataclasses


@dataclasses.dataclass
class Set:
    """One line of the table. Models stand beside this file, written from the README of the recordings."""
    name: str
    model: str
    imports: dict  # record: [file, options of import]
    fitted: list
    held_out: list
    why: str = ""  # what was cut or decimated, and why
    cause: str = ""  # effect that is known to be missing; empty: nobody knows
    add: tuple = ()  # arguments of `add` for it, where diagnose does not name it
    known: tuple = ()  # ((parameter, value, allowed error, its unit, what is added to the estimate), ...)
    by_hand: bool = False  # the cause stands in the model already: what diagnose would name cannot differ from record to record


UNB_GATE = "the force is gated: its sensor's noise, through the model, is 15 to 30 times the accelerometer's"


def unb(number, mass_kg):
    """Hits on the beam with one of the weighed masses; the sensor's 54 g are in the model."""
    names = ["m%dt%d" % (number, k) for k in (1, 2)]
    imports = {name: ["unb_tip_masses/%s.csv" % name, "--gate", "hammer_N"] for name in names}
    return Set("tip mass %g kg, hammer" % mass_kg, "unb", imports, names[:1], names[1:], UNB_GATE, "tip_mass", (),
               (("mass_kg", mass_kg, 0.10 * mass_kg, "kg", 0.054),))


def shaker(number, mass_kg, *frequencies):
    """The same beam under sines, cut out of steady vibration."""
    names = ["shaker_%d_%d" % (number, frequency) for frequency in frequencies]
    imports = {name: ["unb_tip_masses/%s.csv" % name] for name in names}
    return Set("tip mass %g kg, shaker" % mass_kg, "unb_shaker", imports, names, [],
               "both sines are fitted: one tells an amplitude and a phase, and nobody says where the shaker is", "tip_mass", (),
               (("mass_kg", mass_kg, 0.10 * mass_kg, "kg", 0.054),))


ROLLERS = {"step0": (0.073, 0.8), "step3": (0.150, 0.75), "step6": (0.124, 0.65), "step8": (0.073, 0.7)}  # where it is known to be, m; cut, s
ROLLER_CUT = "cut before the roller moves again"


def roller_import(name):
    return ["dropbear_roller/%s.csv" % name, "--free-decay", "--to", "%g" % ROLLERS[name][1]]


def roller(name):
    """A free decay on a roller, which holds the beam: a support, whose stiffness no record of the beam tells."""
    place_m = ROLLERS[name][0]
    return Set("roller at %.0f mm, %s" % (1e3 * place_m, name), "roller", {name: roller_import(name)}, [name], [], ROLLER_CUT, "point_spring",
               ("point_spring", "--at", "0.1", "stiffness_Npm=1e9", "--fix", "stiffness_Npm", "damping_Nspm=0", "--fix", "damping_Nspm",
                "--free", "at_m"), (("at_m", place_m, 0.010, "m", 0.0),))


STRIP = {"bare50_%d" % k: ["adxl_strip/bare50_%d.csv" % k, "--free-decay", "--free-from", "0.6", "--from", "0.6", "--to", "8.6"]
         for k in range(1, 6)}
SILVERBOX = ["silverbox/SNLS80mV.csv", "--channel", "V1_input_V=force_N", "--channel", "V2_output_V=tip_m",
             "--scale", "force_N=2:N", "--scale", "tip_m=0.001:m"]
UOFSC = ["uofsc_steel_cantilever/shaker_test1.csv", "--channel", "force_N=shaker_N", "--channel", "accel_m_s2=accel_mps2"]

SETS = {
    "unb_2": unb(2, 0.766),
    "unb_4": unb(4, 0.182),
    "unb_both": Set("both tip masses, hammer, one beam", "unb_masses",
                    {name: ["unb_tip_masses/%s.csv" % name, "--gate", "hammer_N"] for name in ("m2t1", "m4t1", "m2t2", "m4t2")},
                    ["m2t1", "m4t1"], ["m2t2", "m4t2"], UNB_GATE + "; the mass differs from record to record, so that it stands in the model",
                    "tip_mass", (), (("mass_kg@m2t1.csv", 0.766, 0.0766, "kg", 0.054), ("mass_kg@m4t1.csv", 0.182, 0.0182, "kg", 0.054)),
                    True),
    "shaker_2": shaker(2, 0.766, 12, 6),
    "shaker_4": shaker(4, 0.182, 15, 18),
    "strip": Set("strip in air", "strip", STRIP, ["bare50_1", "bare50_2"], ["bare50_3", "bare50_4", "bare50_5"],
                 "0.6 to 8.6 s: two records begin before the release; later the swings are small",
                 "quadratic_drag", ("quadratic_drag", "coefficient_Ns2pm3=0.1"), (("coefficient_Ns2pm3", 0.44, 0.11, "N s2/m3", 0.0),)),
    **{"roller_" + name[4:]: roller(name) for name in ROLLERS},
    "rollers": Set("four places of the roller, one beam", "rollers", {name: roller_import(name) for name in ROLLERS}, list(ROLLERS), [],
                   ROLLER_CUT + "; its place differs from record to record, so that it stands in the model", "point_spring", (),
                   tuple(("at_m@%s.csv" % name, place_m, 0.010, "m", 0.0) for name, (place_m, _) in ROLLERS.items()), True),
    "silverbox": Set("electronic oscillator", "silverbox",
                     {"ms1": SILVERBOX + ["--from", "66.4797", "--to", "69.833"], "ms3": SILVERBOX + ["--from", "94.9647", "--to", "98.32"]},
                     ["ms1"], ["ms3"], "two multisines of 2048 samples, each from the pause before it", "cubic_stiffness",
                     ("cubic_stiffness", "--at", "0.03", "coefficient_Npm3=1e9")),
    "iitd": Set("patch near the clamp, hit", "iitd",
                {"hit": ["iitd_pzt_cantilever/pzt_free_decay.csv", "--time", "time_s_corrected", "--channel", "pzt_voltage_V=piezo_V",
                         "--free-decay", "--free-from", "1.4", "--from", "1.4", "--to", "2.4"]}, ["hit"], [],
                "one second from 0.24 s after the hit, when its burst is over", "mains_hum",
                ("mains_hum", "frequency_Hz=50", "amplitude=0.05"), (("frequency_Hz", 49.24, 0.1, "Hz", 0.0),)),
    "uofsc": Set("steel, three tones", "uofsc",
                 {"tones1": UOFSC + ["--from", "2", "--to", "3"], "tones2": UOFSC + ["--from", "5", "--to", "6"]},
                 ["tones1"], ["tones2"], "one second each of 20: three steady tones say no more in longer"),
}
