/* SPDX-License-Identifier: MIT */
/* The one struct, the two contexts; start-up code calls main(). */
#include "app.h"

static struct app app;

void app_sample(uint16_t sensor_code)
{
    app_tick(&app, sensor_code);
}

void app_missed(uint32_t n)
{
    atomic_fetch_add(&app.missed, n);
}

int main(void)
{
    const struct board_facts *facts = board_init();
    if (!facts)
        return 1;
    app_init(&app, facts);
    board_start();
    while (board_idle(app_poll(&app)))
        ;
    return 0;
}
