/* fault.c: see fault.h. */
#include "fault.h"

fault *fault_find(fault *first, int kind, uint64_t cycle) {
  for (fault *f = first; f != NULL && f->begin <= cycle; f = f->next) {
    if (f->kind == kind && cycle < f->end) return f;
  }
  return NULL;
}

int fault_insert(fault **first, fault *made) {
  for (const fault *f = *first; f != NULL; f = f->next) {
    if (f->kind == made->kind && f->begin < made->end && made->begin < f->end) return -1;
  }
  while (*first != NULL && (*first)->begin < made->begin) first = &(*first)->next;
  made->next = *first;
  *first = made;
  return 0;
}
