/* What the page that flies in the browser shows of a flight and no history holds. Compiled to WebAssembly only. */
#include "loop.h"

/* Fly as hsv_fly does, step by step; write the positions of the effectors (rows, 2) and the levels of the error in the
 * tube (rows), which are -inf without a set. Return the number of steps flown, or -1 - k if step k failed. */
int64_t hsv_watch(hsv_flight *flight, Loop *loop, double *effector, double *levels)
{
    const hsv_actuators *stops = &flight->plant->actuators;
    for (int64_t k = 0, done; k < flight->rows; k++) {
        loop->levels.worst = -INFINITY; /* the level of this step alone */
        if ((done = hsv_fly(SSE2, 1, &flight, loop, k, k + 1, SENSE | ACT)) < 0) return done;
        for (int j = 0; j < INPUTS; j++)
            effector[INPUTS * k + j] = loop->equipped
                                           ? flight->plant_memory->effector[j]
                                           : limited(loop->actuator[j], stops->minimum[j], stops->maximum[j]);
        levels[k] = flight->worst;
        if (flight->ended == k + 1) break;
        flight->history += HISTORY, flight->auxiliary += AUXILIARY;
        if (flight->estimated) flight->estimated += STATES;
    }
    return flight->ended;
}
