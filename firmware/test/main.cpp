/* doctest's own code and main(), compiled once for all unit tests. */
#define DOCTEST_CONFIG_IMPLEMENT_WITH_MAIN
#include <doctest.h>
