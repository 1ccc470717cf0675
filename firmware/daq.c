/* SPDX-License-Identifier: MIT */
/* Lists, and the ring between the sample interrupt and the line. */
#include "daq.h"
#include <stddef.h>
#include <string.h>
#include "beam_image.h"

_Static_assert((DAQ_RING & (DAQ_RING - 1)) == 0, "a power of two");
_Static_assert(DAQ_ODT_BYTES + 5 <= BEAM_WIRE_MAX_PACKET, "one frame");

void daq_stop(struct daq *daq)
{
    for (int i = 0; i < BEAM_DAQ_LISTS; i++) {
        atomic_store(&daq->list[i].running, false);
        daq->list[i].selected = false;
    }
}

void daq_free(struct daq *daq)
{
    daq_stop(daq);
    daq->n_lists = daq->n_odts = daq->n_entries = 0;
    memset(daq->list, 0, sizeof daq->list);
    memset(daq->odt, 0, sizeof daq->odt);
    memset(daq->entry, 0, sizeof daq->entry);
}

bool daq_running(const struct daq *daq)
{
    bool any = false;
    for (int i = 0; i < BEAM_DAQ_LISTS; i++)
        any |= atomic_load(&daq->list[i].running);
    return any;
}

bool daq_complete(const struct daq *daq, int list)
{
    const struct daq_list *l = &daq->list[list];
    for (int o = l->first_odt; o < l->first_odt + l->n_odts; o++) {
        const struct daq_odt *odt = &daq->odt[o];
        int bytes = 0;
        for (int e = odt->first_entry; e < odt->first_entry + odt->n_entries; e++) {
            if (daq->entry[e].size == 0)
                return false;
            bytes += daq->entry[e].size;
        }
        if (bytes == 0 || bytes > DAQ_ODT_BYTES)
            return false;
    }
    return l->n_odts > 0 && l->prescaler > 0;
}

void daq_start(struct daq *daq, int list)
{
    if (!daq_running(daq)) { /* what an earlier recording left */
        atomic_store(&daq->taken, atomic_load(&daq->written));
        daq->at_list = daq->at_odt = 0;
    }
    daq->list[list].wait = 0;
    daq->list[list].selected = false;
    atomic_store(&daq->list[list].running, true);
}

static uint16_t build(struct daq *daq, const struct daq_item *item)
{
    const struct daq_list *list = &daq->list[daq->at_list];
    const struct daq_odt *odt = &daq->odt[list->first_odt + daq->at_odt];
    const uint8_t *live = (const uint8_t *)&item->live;
    uint8_t *packet = daq->frame + BEAM_WIRE_HEADER;
    uint16_t n = 0;
    packet[n++] = (uint8_t)(list->first_odt + daq->at_odt);
    if (daq->at_odt == 0 && list->timestamp) {
        memcpy(packet + n, &item->time_us, sizeof item->time_us);
        n = (uint16_t)(n + sizeof item->time_us);
    }
    for (int e = odt->first_entry; e < odt->first_entry + odt->n_entries; e++) {
        memcpy(packet + n, live + daq->entry[e].offset, daq->entry[e].size);
        n = (uint16_t)(n + daq->entry[e].size);
    }
    return n;
}

uint16_t daq_next(struct daq *daq)
{
    for (int items = 0; items <= DAQ_RING; items++) {
        const uint32_t taken = atomic_load(&daq->taken);
        if (taken == atomic_load(&daq->written))
            return 0;
        struct daq_item *item = &daq->ring[taken % DAQ_RING];
        for (; daq->at_list < BEAM_DAQ_LISTS; daq->at_list++, daq->at_odt = 0) {
            const struct daq_list *list = &daq->list[daq->at_list];
            if ((item->due & 1u << daq->at_list) == 0 || !atomic_load(&list->running) || daq->at_odt >= list->n_odts)
                continue;
            item->live.crc32 = beam_crc32(0, offsetof(struct beam_live, crc32), (const uint8_t *)&item->live);
            const uint16_t n = build(daq, item);
            daq->at_odt++;
            return n;
        }
        daq->at_list = daq->at_odt = 0;
        atomic_store(&daq->taken, taken + 1);
    }
    return 0;
}

void daq_sample(struct daq *daq, const struct beam_live *live, uint32_t time_us)
{
    uint8_t due = 0;
    for (int i = 0; i < BEAM_DAQ_LISTS; i++) {
        struct daq_list *list = &daq->list[i];
        if (!atomic_load(&list->running))
            continue;
        if (list->wait == 0) {
            due = (uint8_t)(due | 1u << i);
            list->wait = list->prescaler;
        }
        list->wait--;
    }
    if (due == 0)
        return;
    const uint32_t written = atomic_load(&daq->written);
    if (written - atomic_load(&daq->taken) >= DAQ_RING) {
        atomic_fetch_add(&daq->overrun, 1);
        return;
    }
    struct daq_item *item = &daq->ring[written % DAQ_RING];
    item->live = *live;
    item->time_us = time_us;
    item->due = due;
    atomic_store(&daq->written, written + 1);
}
