#if defined(LH_FREESTANDING)
#define memset(to, byte, size) __builtin_memset(to, byte, size)
#else
#include <string.h>
#endif
