/* SPDX-License-Identifier: GPL-3.0-or-later */
/*
 * port_serial.c — real serial ports; the only file that sees libserialport.
 *
 * After a USB adapter is pulled out libserialport's reads return 0 for ever; only writes and sp_input_waiting() fail,
 * so an empty read asks the latter.
 */
#include <errno.h>
#include <libserialport.h>
#include <stdio.h>
#include <string.h>

#include "port_driver.h"

void port_list(size_t size, char text[])
{
    struct sp_port **ports = NULL;
    size_t n = (size_t)snprintf(text, size, "; no serial port was found: is the cable in?");
    if (sp_list_ports(&ports) != SP_OK)
        return;
    for (size_t i = 0; ports[i] != NULL && n < size; i++) {
        const char *words = sp_get_port_description(ports[i]);
        if (i == 0)
            n = (size_t)snprintf(text, size, "; ports here:");
        if (n < size)
            n += (size_t)snprintf(text + n, size - n, "%s %s (%s)", i > 0 ? "," : "", sp_get_port_name(ports[i]),
                                  words != NULL ? words : "unnamed");
    }
    sp_free_port_list(ports);
}

static bool configure(struct sp_port *handle, long baud)
{
    return sp_set_baudrate(handle, (int)baud) == SP_OK && sp_set_bits(handle, 8) == SP_OK &&
           sp_set_parity(handle, SP_PARITY_NONE) == SP_OK && sp_set_stopbits(handle, 1) == SP_OK &&
           sp_set_flowcontrol(handle, SP_FLOWCONTROL_NONE) == SP_OK;
}

static int serial_open(struct port *port)
{
    struct sp_port *handle = NULL;
    if (sp_get_port_by_name(port->node, &handle) != SP_OK)
        return PORT_NOT_SERIAL;
    if (sp_open(handle, SP_MODE_READ_WRITE) != SP_OK) {
        const int reason = sp_last_error_code();
        sp_free_port(handle);
        return reason > 0 ? reason : EIO;
    }
    if (!configure(handle, port->baud) || sp_get_port_handle(handle, &port->fd) != SP_OK) {
        (void)sp_close(handle);
        sp_free_port(handle);
        return PORT_NO_SUCH_RATE;
    }
    port->handle = handle;
    return 0;
}

static void serial_close(struct port *port)
{
    (void)sp_close(port->handle);
    sp_free_port(port->handle);
}

static long serial_read(struct port *port, size_t n, uint8_t out[])
{
    const enum sp_return got = sp_nonblocking_read(port->handle, out, n);
    if (got > 0)
        return got;
    return sp_input_waiting(port->handle) < 0 ? PORT_GONE : 0;
}

static long serial_write(struct port *port, size_t n, const uint8_t bytes[])
{
    const enum sp_return sent = sp_nonblocking_write(port->handle, bytes, n);
    if (sent >= 0)
        return sent;
    errno = sp_last_error_code();
    return errno == EAGAIN || errno == EINTR ? 0 : errno == EIO ? PORT_GONE : PORT_FAILED;
}

static int serial_flush(struct port *port)
{
    if (sp_flush(port->handle, SP_BUF_BOTH) == SP_OK)
        return 0;
    errno = sp_last_error_code();
    return PORT_FAILED;
}

const struct port_driver port_driver_serial = {serial_open, serial_close, serial_read, serial_write, serial_flush};
