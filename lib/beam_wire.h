/* SPDX-License-Identifier: MIT */
/*
 * beam_wire.h — the serial line between a host and a controller: XCP 1.1 on SxI (ASAM), asynchronous 8N1.
 *
 *     LEN u16 | CTR u16 | packet of LEN bytes | fill 0 when LEN is odd | SUM u16         little-endian
 *
 * SUM is the sum of the 16-bit words before it, modulo 2¹⁶. LEN outside 1..248 is discarded byte by byte; a gap of
 * 50 ms inside a frame starts anew. The controller is silent until CONNECT; CONNECT stops DAQ and locks again.
 * Constants and memory map only: both sides include it, each has its own code.
 */
#ifndef BEAM_WIRE_H
#define BEAM_WIRE_H

#include <stdint.h>
#include "beam_language.h"

enum {
    BEAM_WIRE_MAX_PACKET = 248, /* MAX_CTO = MAX_DTO */
    BEAM_WIRE_HEADER = 4,
    BEAM_WIRE_TAIL = 2,
    BEAM_WIRE_MAX_FRAME = BEAM_WIRE_HEADER + BEAM_WIRE_MAX_PACKET + BEAM_WIRE_TAIL,
    BEAM_WIRE_GAP_MS = 50
};

/* Commands (packet identifier of a CTO). */
enum {
    BEAM_XCP_CONNECT = 0xFF,
    BEAM_XCP_DISCONNECT = 0xFE,
    BEAM_XCP_GET_STATUS = 0xFD,
    BEAM_XCP_SYNCH = 0xFC,
    BEAM_XCP_GET_COMM_MODE_INFO = 0xFB,
    BEAM_XCP_GET_ID = 0xFA,
    BEAM_XCP_SET_REQUEST = 0xF9, /* bit 0 STORE_CAL: write the active page to the older slot */
    BEAM_XCP_GET_SEED = 0xF8,
    BEAM_XCP_UNLOCK = 0xF7,
    BEAM_XCP_SET_MTA = 0xF6,
    BEAM_XCP_UPLOAD = 0xF5,
    BEAM_XCP_SHORT_UPLOAD = 0xF4,
    BEAM_XCP_BUILD_CHECKSUM = 0xF3, /* type 9, CRC-32 */
    BEAM_XCP_DOWNLOAD = 0xF0,
    BEAM_XCP_SHORT_DOWNLOAD = 0xED,
    BEAM_XCP_SET_CAL_PAGE = 0xEB,
    BEAM_XCP_GET_CAL_PAGE = 0xEA,
    BEAM_XCP_GET_PAG_PROCESSOR_INFO = 0xE9,
    BEAM_XCP_GET_SEGMENT_INFO = 0xE8,
    BEAM_XCP_GET_PAGE_INFO = 0xE7,
    BEAM_XCP_COPY_CAL_PAGE = 0xE4,
    BEAM_XCP_SET_DAQ_PTR = 0xE2,
    BEAM_XCP_WRITE_DAQ = 0xE1,
    BEAM_XCP_SET_DAQ_LIST_MODE = 0xE0,
    BEAM_XCP_START_STOP_DAQ_LIST = 0xDE,
    BEAM_XCP_START_STOP_SYNCH = 0xDD,
    BEAM_XCP_GET_DAQ_CLOCK = 0xDC,
    BEAM_XCP_GET_DAQ_PROCESSOR_INFO = 0xDA,
    BEAM_XCP_GET_DAQ_RESOLUTION_INFO = 0xD9,
    BEAM_XCP_GET_DAQ_EVENT_INFO = 0xD7,
    BEAM_XCP_FREE_DAQ = 0xD6,
    BEAM_XCP_ALLOC_DAQ = 0xD5,
    BEAM_XCP_ALLOC_ODT = 0xD4,
    BEAM_XCP_ALLOC_ODT_ENTRY = 0xD3
};

enum { BEAM_XCP_RES = 0xFF, BEAM_XCP_ERR = 0xFE, BEAM_XCP_EV = 0xFD, BEAM_XCP_SERV = 0xFC };

/* Error codes of an ERR packet (ASAM), and what this controller means by them. */
enum {
    BEAM_XCP_ERR_CMD_SYNCH = 0x00,
    BEAM_XCP_ERR_CMD_BUSY = 0x10, /* a check or a store is under way */
    BEAM_XCP_ERR_DAQ_ACTIVE = 0x11,
    BEAM_XCP_ERR_CMD_UNKNOWN = 0x20,
    BEAM_XCP_ERR_CMD_SYNTAX = 0x21,
    BEAM_XCP_ERR_OUT_OF_RANGE = 0x22,
    BEAM_XCP_ERR_WRITE_PROTECTED = 0x23, /* page 0 */
    BEAM_XCP_ERR_ACCESS_DENIED = 0x24,   /* no such memory */
    BEAM_XCP_ERR_ACCESS_LOCKED = 0x25,   /* UNLOCK first, or wait; a wrong key: the session is over */
    BEAM_XCP_ERR_PAGE_NOT_VALID = 0x26,  /* the staged image was refused: info.last_fault says why */
    BEAM_XCP_ERR_MODE_NOT_VALID = 0x27,
    BEAM_XCP_ERR_SEGMENT_NOT_VALID = 0x28,
    BEAM_XCP_ERR_SEQUENCE = 0x29,
    BEAM_XCP_ERR_DAQ_CONFIG = 0x2A,
    BEAM_XCP_ERR_MEMORY_OVERFLOW = 0x30,
    BEAM_XCP_ERR_GENERIC = 0x31, /* the store failed */
    BEAM_XCP_ERR_VERIFY = 0x32
};

/* Resources of GET_STATUS, GET_SEED. Reading and DAQ are open; calibration, storing, the drive and the latch are locked. */
enum { BEAM_XCP_RESOURCE_CAL_PAG = 0x01, BEAM_XCP_RESOURCE_DAQ = 0x04 };
enum {
    BEAM_XCP_SEED_BYTES = 16,
    BEAM_XCP_KEY_BYTES = 16
}; /* key = HMAC-SHA256(device key, resource byte ‖ seed)[0..15] */

/* Memory map, address extension 0. */
enum {
    BEAM_WIRE_IMAGE =
        0x00010000, /* the calibration segment 0, BEAM_IMAGE_BYTES long: the page that XCP access is set to */
    BEAM_WIRE_LIVE = 0x00020000, /* struct beam_live, read only */
    BEAM_WIRE_INFO = 0x00030000, /* struct beam_info, read only */
    BEAM_WIRE_DRIVE =
        0x00040000, /* struct beam_drive, read and, unlocked, write; takes effect when `generation` is written */
    BEAM_WIRE_TRACKING = 0x00070000, /* struct beam_tracking, read only */
    BEAM_WIRE_LATCH =
        0x00060000 /* u32: writing it, unlocked, acknowledges the latch of beam_info; reads as info.latched */
};
enum { BEAM_WIRE_PAGE_ACTIVE = 0, BEAM_WIRE_PAGE_STAGING = 1 };

/* One sample as DAQ event 0 sends it. A step writes it at once; a DAQ list reads it before the next step. */
struct beam_live {
    uint32_t
        sequence; /* sample intervals since power-on: a gap is a record that was lost, or a sample that info.missed counts */
    uint32_t step;    /* steps since the model was last put to rest: what a replay needs */
    float input;      /* input's unit */
    float measured;   /* output's unit, of the sample that predicted belongs to */
    float predicted;  /* output's unit */
    float residual;   /* measured − predicted */
    float innovation; /* of the residual what the observer did not expect; without one the residual */
    float ratio;      /* running residual rms about its mean ÷ noise_rms */
    float
        innovation_ratio; /* running rms of the innovation, each at most 1.12 alarm_ratio, ÷ its expected rms; without an observer the ratio */
    uint32_t codes;  /* sensor code in bits 0..15, drive code in bits 16..31 */
    uint32_t status; /* BEAM_LIVE_… below */
    uint32_t crc32;  /* of the bytes before it */
};
BEAM_ASSERT(sizeof(struct beam_live) == 48, "live");

enum {
    BEAM_LIVE_ALARM =
        1u
        << 0, /* the innovation_ratio was above alarm_ratio for averaging_s/4, or the ratio longer than any push lasts */
    BEAM_LIVE_BUILT_IN = 1u << 1, /* the model is the built-in one */
    BEAM_LIVE_SOLVE = 1u << 2,    /* beam_step() said SOLVE in this step */
    BEAM_LIVE_RESET = 1u << 3,    /* the state was not finite and was put to rest in this step */
    BEAM_LIVE_CLIPPED = 1u << 4,  /* the sensor's code is at an end of its range */
    /*
     * The sensor itself, from its codes alone but for OFFSET. Each goes off 256 samples after its cause, OFFSET when the mean
     * is below half its limit. While QUIET, STUCK or AT_END is on, ALARM is off: nothing can be said of the model.
     */
    BEAM_LIVE_QUIET =
        1u << 5, /* the codes' rms about their mean was below quiet_ratio × noise in a block of 64 samples */
    BEAM_LIVE_STUCK = 1u << 6,  /* setup.stuck_samples equal codes in a row */
    BEAM_LIVE_AT_END = 1u << 7, /* 8 of a block of 64 codes were at an end of the range */
    BEAM_LIVE_OFFSET =
        1u << 8, /* the residual's mean is above offset_ratio × noise_rms and stands out of its variance */
    /* The ratio is above alarm_ratio and the innovation_ratio is not: a push, or a beam that moved at power-on, as the model has it. */
    BEAM_LIVE_DISTURBED = 1u << 9,
    BEAM_LIVE_SENSOR = BEAM_LIVE_QUIET | BEAM_LIVE_STUCK | BEAM_LIVE_AT_END | BEAM_LIVE_OFFSET,
    BEAM_LIVE_COUNTER = 24 /* bits 24..31: active image's counter, lowest byte: which model this sample saw */
};

/* Why a board started: power, its reset pin, a fault of the processor, its watchdog. */
enum beam_reset { BEAM_RESET_POWER, BEAM_RESET_PIN, BEAM_RESET_FAULT, BEAM_RESET_WATCHDOG, BEAM_RESETS };

enum beam_boot_choice { BEAM_BOOT_BUILT_IN, BEAM_BOOT_SLOT_0, BEAM_BOOT_SLOT_1, BEAM_BOOT_DOWNLOADED };

struct beam_info {
    uint32_t firmware_version; /* major << 16 | minor << 8 | patch */
    uint32_t image_layout;     /* BEAM_IMAGE_LAYOUT */
    uint32_t image_bytes;      /* BEAM_IMAGE_BYTES */
    uint8_t device[12];
    uint32_t sample_mHz;    /* sample rate in 1/1000 Hz */
    uint32_t running;       /* enum beam_boot_choice of the active page */
    uint32_t counter;       /* of the active image */
    uint32_t stored;        /* greatest counter in the store; an image must exceed it and the active one */
    uint32_t missed;        /* conversions that were due and did not take place, from the board's timer */
    uint32_t overrun;       /* DAQ samples that found no room on the line */
    uint32_t frames_bad;    /* frames dropped: length or sum */
    uint32_t wrong_keys;    /* since power-on */
    uint32_t refused;       /* images refused since power-on */
    uint32_t last_fault;    /* enum beam_image_fault of the last refusal */
    uint32_t slot_state[2]; /* 0 empty, 1 valid, 2 spoilt */
    uint32_t boots;         /* starts counted in the store, whatever their reason */
    uint32_t nvm_errors;    /* failed erases and programmings since power-on */
    uint32_t worst_step_us; /* longest sample interrupt */
    uint8_t model_sha256[32];
    uint32_t core_Hz;     /* clock of the processor */
    uint32_t step_budget; /* instructions that the bound of a step may have: beam_image_budget() */
    uint32_t step_bound;  /* of the active image: beam_image_bound() */
    uint32_t proof_us;    /* longest step in the active image's proof run; 0: below 1 µs, or the built-in model */
    uint32_t sequence;    /* of the newest sample: what the next four are counted from */
    /* The latch: what came since power-on, or since it was acknowledged; no session begins or ends it. */
    uint32_t latched;     /* BEAM_LIVE_ALARM and BEAM_LIVE_SENSOR bits that were on */
    uint32_t alarms;      /* times that ALARM came */
    uint32_t faults;      /* times that one of the sensor's faults came */
    uint32_t latch_first; /* sequence of the first of them; 0 with latched 0 */
    uint32_t latch_last;  /* of the last one that came */
    uint32_t drive_stops; /* drives that were stopped because their session ended or fell silent, since power-on */
    uint32_t reset;       /* enum beam_reset of this start */
    uint32_t resets[BEAM_RESETS]; /* starts for each reason since power was applied, this one included */
};
BEAM_ASSERT(sizeof(struct beam_info) == 180, "info");

/*
 * Modes that the board follows, when the image asks for it (struct beam_image_tracking); the model stays as it is. The standard errors hold for
 * white noise and for modes that wander as much as the image says, and begin at a tenth of the frequency, all of the damping, 0.3 of the gain.
 */
struct beam_tracked {
    float frequency_Hz, frequency_se_Hz; /* |pole|/2π */
    float damping, damping_se;           /* share of critical damping */
    float gain, gain_se;                 /* from drive to sensor, of the model's */
};
struct beam_tracking {
    uint32_t modes;   /* that are followed: 0 to 3, in the order of the image's blocks */
    uint32_t samples; /* since it began, at power-on or when the model was put to rest; stays at 2²⁴ */
    float
        innovation_rms; /* of what the followed modes leave of the residual, each cut at three times this; output's unit */
    struct beam_tracked mode[3];
};
BEAM_ASSERT(sizeof(struct beam_tracking) == 84, "tracking");

/*
 * The drive: a linear or repeated chirp, made on the controller so that host and controller know it exactly.
 * u = amplitude × sin(phase), phase in whole 2⁻³² turns: phase += rate, rate += sweep each sample, from 0 again after
 * `period` samples; nothing is added to the D/A's zero for an amplitude of 0. Writing `generation` (any new value)
 * starts it, and puts the model's state to rest when BEAM_DRIVE_REST is set. It wants an unlocked session, and goes on only as long as
 * that: it stops, and its amplitude reads 0, at CONNECT, DISCONNECT and a wrong key, and when no command has come for
 * BEAM_DRIVE_DEAD_MAN_MS.
 */
struct beam_drive {
    float amplitude;      /* D/A codes, 0..2047 */
    uint32_t rate, sweep; /* 2⁻³² turns a sample, and the change of it a sample */
    uint32_t period;      /* samples; 0: never again from the start */
    uint32_t burst;       /* samples of drive in each period, then zero; 0: all of it */
    uint32_t flags;       /* BEAM_DRIVE_REST */
    uint32_t generation;
};
BEAM_ASSERT(sizeof(struct beam_drive) == 28, "drive");
enum { BEAM_DRIVE_REST = 1u << 0 };
enum { BEAM_DRIVE_DEAD_MAN_MS = 2000 };

/* EV_USER: 0xFD, 0xFE, kind, 0, and for the second kind the status bits that are on now, u32: ALARM and SENSOR. */
enum { BEAM_EVENT_STORE_FAILED = 1, BEAM_EVENT_ALARM = 2 };

/* DAQ: one list of up to 4 ODTs of up to 8 entries, absolute ODT numbers, 32-bit time stamps of 1 µs, event 0 = the sample. */
enum { BEAM_DAQ_LISTS = 2, BEAM_DAQ_ODTS = 4, BEAM_DAQ_ENTRIES = 16, BEAM_DAQ_EVENTS = 1 };

#endif /* BEAM_WIRE_H */
