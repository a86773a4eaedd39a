/* An instance of the loop for NAME and LANES: hsv_fly_NAME, and hsv_memory_NAME, the size (bytes) of its memory. */
#include "loop.h"
#define JOINED_(a, b) a##b
#define JOINED(a, b) JOINED_(a, b)

int64_t JOINED(hsv_fly_, NAME)(hsv_flight *const *flights, void *memory, int64_t start, int64_t stop, int halves)
{
    return fly(flights, memory, start, stop, halves);
}
const int64_t JOINED(hsv_memory_, NAME) = sizeof(Loop);
