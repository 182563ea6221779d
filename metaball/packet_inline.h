// How the functions of the packet tracers are inlined. Internal to metaball/.
#pragma once

#include <hwy/base.h>

// All into one function, in what users run. With a sanitizer's checks in it that one function takes
// the compiler minutes: there it chooses by itself.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define SHERD_PACKET_INLINE inline
#else
#define SHERD_PACKET_INLINE HWY_INLINE
#endif
