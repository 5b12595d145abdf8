/* codec_to_board.c: the board's end of codec.h. */
#define END(name) to_board_##name
#include "codec_end.h"
