/* Communication links of the loop with delay, loss and corruption of their payloads, one payload a step.
 *
 * The receiver uses the last payload that arrived. Losses follow a two-state Gilbert channel (Gilbert 1960). Corruption
 * flips one bit of one number. The receiver detects it by a checksum, or if the number is not finite or exceeds
 * LARGEST; the payload is then lost. */
#pragma once
#include "noise.h"

/* Fill a link with one payload, as if it had been sent in all earlier steps. */
void hsv_fill_link(double *memory, int64_t size, const double *payload, int64_t n)
{
    for (int64_t i = 0; i < size - ACCEPTED; i++) memory[ACCEPTED + i] = payload[i % n];
    memory[NEWEST] = -(double)size;
    memory[BEGUN] = 1.0;
}

/* Corrupt the arriving payload (n) with the probability of the link; return whether the receiver accepts it. */
static int passes(const hsv_link *link, double *payload, int64_t n, int64_t k, int64_t seed)
{
    double drawn[2];
    hsv_uniforms(seed, k, LINK_CORRUPTION + link->channel, 0, drawn);
    if (!(drawn[0] < link->corruption)) return 1;
    if (link->checksum) return 0;
    const int64_t bit = (int64_t)(drawn[1] * (double)(64 * n));
    double *number = &payload[bit / 64];
    const double before = *number;
    uint64_t word;
    memcpy(&word, number, sizeof word);
    word ^= UINT64_C(1) << (bit % 64);
    memcpy(number, &word, sizeof word);
    if (magnitude(*number) <= LARGEST) return 1;
    memcpy(number, &before, sizeof before); /* restored, because with jitter the payload may arrive a second time */
    return 0;
}

/* Replace the payload (n) sent in step k by the payload that the receiver uses in step k. */
void hsv_receive(const hsv_link *link, double *memory, int64_t size, int64_t k, int64_t seed, double *payload,
                 int64_t n)
{
    const int64_t room = n > 0 ? (size - ACCEPTED) / n - 1 : 0; /* slots for which the memory has space */
    if (link->ideal || room < 1) return;
    if (memory[BEGUN] == 0.0) hsv_fill_link(memory, size, payload, n);
    const int64_t due_slots = link->delay + link->jitter + 1, slots = due_slots < 1 || due_slots > room ? 1 : due_slots;
    memcpy(memory + ACCEPTED + n * (1 + k % slots), payload, (size_t)n * sizeof *payload);
    int64_t newest = k - link->delay;
    if (link->jitter > 0)
        newest -= (int64_t)(first_uniform(seed, k, LINK_DELAY + link->channel, 0) * (double)(link->jitter + 1));
    int arrives = (double)newest > memory[NEWEST];
    if (link->loss > 0.0) {
        const double drawn = first_uniform(seed, k, LINK_LOSS + link->channel, 0);
        const double due = memory[LOSING] == 1.0 ? link->loss_after_loss : link->loss_after_arrival;
        const int lost = drawn < (k == 0 ? link->loss : due);
        memory[LOSING] = lost;
        arrives = arrives && !lost;
    }
    if (arrives) {
        const int64_t slot = (newest % slots + slots) % slots; /* newest is negative for payloads before the flight */
        double *arriving = memory + ACCEPTED + n * (1 + slot);
        if (!(link->corruption > 0.0) || passes(link, arriving, n, k, seed)) {
            memcpy(memory + ACCEPTED, arriving, (size_t)n * sizeof *payload);
            memory[NEWEST] = (double)newest;
        }
    }
    memcpy(payload, memory + ACCEPTED, (size_t)n * sizeof *payload);
}
