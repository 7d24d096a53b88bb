/* SPDX-License-Identifier: Apache-2.0 */
/* SARSA (2.15) with a softmax (2.24) on the arrays of a grid world, in plain C.

   Random numbers: xorshift64*, with one word of state that splitmix64 seeds. */

#include <math.h>
#include <stdint.h>

static uint64_t bits;

static void seed_with(uint64_t seed)
{
    uint64_t z = seed + 0x9E3779B97F4A7C15u;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    bits = (z ^ (z >> 31)) | 1;
}

static double uniform(void)
{
    bits ^= bits >> 12;
    bits ^= bits << 25;
    bits ^= bits >> 27;
    return (double)((bits * 0x2545F4914F6CDD1Du) >> 11) * 0x1.0p-53;
}

static int softmax_action(const double *values, double scale)
{
    double best = values[0], weights[4], total = 0.0;
    for (int a = 1; a < 4; a++)
        best = values[a] > best ? values[a] : best;
    for (int a = 0; a < 4; a++)
        total += weights[a] = exp((values[a] - best) * scale);
    double x = uniform() * total;
    for (int a = 0; a < 3; a++) {
        if (x < weights[a])
            return a;
        x -= weights[a];
    }
    return weights[3] > 0.0 ? 3 : weights[2] > 0.0 ? 2 : weights[1] > 0.0 ? 1 : 0;
}

static int taken_action(int a, const uint8_t *slips, double intended)
{
    int others[3], count = 0;
    double u = uniform();
    if (u < intended)
        return a;
    for (int b = 0; b < 4; b++)
        if (b != a && slips[b])
            others[count++] = b;
    int pick = (int)((u - intended) / (1.0 - intended) * count);
    return count ? others[pick < count ? pick : count - 1] : a;
}

/* Change q, visits and returns[iteration]; return the steps taken. */
int64_t learn(int32_t starts_count, const int32_t *starts, const int32_t *successor,
              const double *reward, const uint8_t *slips, const uint8_t *terminal,
              double intended, int32_t step_limit, int32_t iterations, int32_t episodes,
              int32_t measuring, double discount, double rate, double visit_growth,
              double temperature, double factor, double lowest, uint64_t seed,
              double *q, double *visits, double *returns)
{
    int64_t steps = 0;
    seed_with(seed);
    for (int iteration = 0; iteration < iterations; iteration++) {
        double scale = 1.0 / temperature, total = 0.0;
        for (int episode = 0; episode < episodes; episode++) {
            int s = starts[(int)(uniform() * starts_count)];
            int a = softmax_action(q + 4 * s, scale);
            for (int step = 0; step < step_limit && !terminal[s]; step++, steps++) {
                int pair = 4 * s + a, move = 4 * s + taken_action(a, slips + 4 * s, intended);
                int s2 = successor[move];
                double target = reward[move];
                total += target;
                if (!terminal[s2]) {
                    a = softmax_action(q + 4 * s2, scale);
                    target += discount * q[4 * s2 + a];
                }
                if (iteration >= measuring) {
                    q[pair] += rate / visits[pair] * (target - q[pair]);
                    visits[pair] += visit_growth;
                }
                s = s2;
            }
        }
        returns[iteration] = total / episodes;
        temperature = temperature * factor > lowest ? temperature * factor : lowest;
    }
    return steps;
}
