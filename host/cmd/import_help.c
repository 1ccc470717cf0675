/* SPDX-License-Identifier: GPL-3.0-or-later */
#include "import_help.h"

const char import_about[] =
    "Usage: beamfit import FILE [FILE2] -o OUT.csv [options]\n"
    "       beamfit import FILE --list [--json]\n"
    "\n"
    "Turns a foreign recording into a record: CSV with a header row, 'time_s' first, uniform in time. Reads\n"
    "Universal File Format 58 (ASCII and 58b binary), MATLAB .mat (5 and 7.3), LabVIEW .lvm, NumPy .npy, WAV, and\n"
    "text tables (separator , ; tab or blank; decimal point or comma; header and units rows or none). Nothing is\n"
    "converted silently: units that the file states are written down, numbers stay as they are. Where the data\n"
    "come from (file, SHA-256, this command) is written into '#' lines of the record.\n";

const struct option_row import_options[] = {
    {.what = "First look what is there, then choose:"},
    {OPTION_LIST, 0, "list", NULL, NULL, "channels, units, samples, time axes; writes nothing"},
    {OPTION_CHANNEL, 0, "channel", "FROM=TO", NULL,
     "take channel FROM as column TO (again for each column); =TO may be left out. FROM is the name in the "
     "list, or #3 for the third. Without: all channels"},
    {OPTION_TIME, 0, "time", "CHANNEL", NULL, "the channel that holds the times"},
    {OPTION_TIME_UNIT, 0, "time-unit", "UNIT", "s|ms|us|min",
     "unit of the times: s, ms, us, min (default: as the file says, else s)"},
    {OPTION_RATE, 0, "rate", "HZ", NULL, "sampling rate, instead of a time channel or against a wrong one"},
    {OPTION_SCALE, 0, "scale", "NAME=K[:UNIT]", NULL,
     "multiply a column by K; UNIT is what it is then in (accel_mps2=9.80665:m/s^2). K may be arithmetic "
     "(1/22.5, 9.81/0.1) or a sensitivity with units: 100mV/g, 10.2mV/(m/s^2), 22.5mV/N, 4pC/N, 5mm/s/V; "
     "the channel is then in V or pC, or in what the file says"},
    {OPTION_RESAMPLE, 0, "resample", "HZ", NULL,
     "jittered or polled times brought to a uniform rate, band-limited; what that leaves is said"},
    {OPTION_GATE, 0, "gate", "NAME[=FROM:TO]", NULL,
     "a hammer's force: 0 outside its hits (or these seconds), its offset taken off"},
    {OPTION_FROM, 0, "from", "S", NULL, "keep what is not before this time, s"},
    {OPTION_TO, 0, "to", "S", NULL, "keep what is not after this time, s"},
    {.what = "Frequency responses (UFF 58 tells by itself): columns OUTPUT/INPUT_re and _im, or _magnitude or _dB "
             "with _deg or _rad, and OUTPUT/INPUT_coherence"},
    {OPTION_FREQUENCY, 0, "frequency", "CHANNEL", NULL,
     "the channel that holds the frequencies in Hz, instead of times"},
    {OPTION_AVERAGES, 0, "averages", "N", NULL, "averages behind the coherence: the noise of each line is then known"},
    {OPTION_WINDOW, 0, "exponential-window", "S", NULL,
     "time constant of the window on force and answer; its damping is taken off"},
    {.what = "Two files of one run (2:NAME is a channel of the second; the second's come to the first's times, "
             "band-limited):"},
    {OPTION_TRIGGER, 0, "trigger", "A=B", NULL,
     "move the second's times until the edges of column A of the first and B of the second meet; B is left "
     "out. Without: their times agree as they are"},
    {.what = "What is known of the excitation (read by fit and compare):"},
    {OPTION_FREE_DECAY, 0, "free-decay", NULL, NULL,
     "no input was recorded: the beam swings freely from an unknown state"},
    {OPTION_FREE_FROM, 0, "free-from", "S", NULL, "... from this time on, in seconds of the record"},
    {OPTION_UNKNOWN_LEVEL, 0, "unknown-level", NULL, NULL, "the input's shape was recorded, its level is unknown"},
    {.what = "Output and reading:"},
    {'o', 'o', "output", "FILE", NULL, "the record, written whole or not at all"},
    {OPTION_FORCE, 0, "force", NULL, NULL,
     "replace FILE even when `import` has not made it or somebody has changed it"},
    {OPTION_DIGITS, 0, "digits", "N", NULL, "significant digits (default 9; 17 keeps every bit)"},
    {OPTION_FORMAT, 0, "format", "FORMAT", NULL,
     "the kind of file where the content does not tell: uff, mat ...; a wrong FORMAT lists all"},
    {OPTION_SEPARATOR, 0, "separator", "C", NULL, "of a text table: ',' ';' ' ' or 'tab'"},
    {OPTION_DECIMAL, 0, "decimal", "C", NULL, "its decimal point: '.' or ','"},
    OPTIONS_JSON,
    {0},
};

const char import_closing[] =
    "Examples:\n"
    "  A voltmeter's record of a hit at 1.16 s, with two time columns, of which the second is right:\n"
    "    beamfit import pzt_free_decay.csv --list\n"
    "    beamfit import pzt_free_decay.csv --time time_s_corrected --channel pzt_voltage_V=piezo_V \\\n"
    "                   --free-decay --free-from 1.175 -o hit.csv\n"
    "  An accelerometer in g from LabVIEW, made m/s^2:\n"
    "    beamfit import test.lvm --channel Force=hammer_N --channel Accel=accel_mps2 \\\n"
    "                   --scale accel_mps2=9.80665:m/s^2 -o test.csv\n"
    "  A force and an acceleration by two loggers, both with the trigger; 22.5 mV/N and 100 mV/g:\n"
    "    beamfit import force.txt accel.npy --channel F=hammer_N --channel T=trigger_V --channel 2:a=accel_mps2 \\\n"
    "                   --channel 2:t=start_V --trigger trigger_V=start_V --scale hammer_N=22.5mV/N \\\n"
    "                   --scale accel_mps2=100mV/g -o run.csv\n"
    "  A German spreadsheet of volts without time, 2 kHz:\n"
    "    beamfit import messung.csv --rate 2000 --channel '#1=piezo_V' -o messung_record.csv\n"
    "  A frequency response of an analyser, as dB and degrees:\n"
    "    beamfit import frf.csv --frequency Freq --channel Mag=accel_mps2/hammer_N_dB \\\n"
    "                   --channel Phase=accel_mps2/hammer_N_deg --channel Coh=accel_mps2/hammer_N_coherence \\\n"
    "                   --averages 10 -o response.csv\n"
    "  A WAV file, of an interface with 2.5 V full scale:\n"
    "    beamfit import hit.wav --channel '#1=piezo_V' --scale piezo_V=2.5:V -o hit.csv\n"
    "\n"
    "Exit status: 0 done; 2 usage, or a choice the file cannot satisfy; 3 a bad file, or output not writable.\n";
