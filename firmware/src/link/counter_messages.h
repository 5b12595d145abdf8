/* counter_messages.h: the counters' message and those of the tasks' times, one after another. */
#ifndef LINK_COUNTER_MESSAGES_H
#define LINK_COUNTER_MESSAGES_H

void counter_messages_start(void);

#endif
