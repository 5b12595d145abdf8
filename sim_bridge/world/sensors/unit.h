/* unit.h: what a device keeps from run to run: the peculiarities of one unit, keyed by its serial number and not by the
 * run's seed. The same unit has the same bias on every robot and in every run. */
#ifndef SENSORS_UNIT_H
#define SENSORS_UNIT_H

#include <stdint.h>

/* python: begin */
/* Standard normal draw of quantity `what` of unit `serial` of a kind of device; 0 for serial 0, the nominal unit. */
double unit_normal(uint64_t serial, uint32_t kind, uint32_t what);
/* python: end */

#endif
