/* SPDX-License-Identifier: GPL-3.0-or-later */
/* port_driver.h — what a back end of port.c provides. Every text for a person is in port.c. */
#ifndef BEAMFIT_PORT_DRIVER_H
#define BEAMFIT_PORT_DRIVER_H

#include "board.h"

struct port_driver;
struct port {
    const struct port_driver *driver;
    char *path; /* as given */
    char *node; /* links resolved */
    long baud;
    int fd;       /* to wait on and to lock; the driver's */
    void *handle; /* the driver's */
};

enum { PORT_NOT_SERIAL = -1, PORT_NO_SUCH_RATE = -2 }; /* of opening, beside errno */
enum { PORT_GONE = -1, PORT_FAILED = -2 };             /* gone: the far end; failed: errno says why */

struct port_driver {
    /* Sets fd and handle and returns 0. Else an errno, PORT_NOT_SERIAL or PORT_NO_SUCH_RATE; then nothing is left open. */
    int (*open)(struct port *port);
    void (*close)(struct port *port);
    /* Bytes read or written now, without waiting; 0: none; PORT_GONE; PORT_FAILED. */
    long (*read)(struct port *port, size_t n, uint8_t out[]);
    long (*write)(struct port *port, size_t n, const uint8_t bytes[]);
    /* 0 or PORT_FAILED. */
    int (*flush)(struct port *port);
};

extern const struct port_driver port_driver_serial, port_driver_pty;

#endif
