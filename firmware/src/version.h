/* version.h: the firmware's version, as the board reports it. */
#ifndef VERSION_H
#define VERSION_H

#define FIRMWARE_VERSION "0.1.0"

#endif
