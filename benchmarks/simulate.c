/* Copyright 2026 engb_ros maintainers; SPDX-License-Identifier: Apache-2.0 */
/* The closed loop of engb_core/simulation.py for the nominal brake, in plain C: the same terms in
 * the same order, so that the numbers agree. Compiled and called by benchmarks/simulate.py. */
#include <math.h>

typedef struct {
    double inertia, viscous, coulomb, load_gain, saturation, contact;
    long terms;
    double load[12];
    double proportional, integral, derivative, limit, tick, step;
} brake;

static double load_torque(const brake *b, double position)
{
    double travel = position, total = 0.0;
    if (!isnan(b->contact)) {
        travel = position - b->contact;
        if (travel < 0.0) return 0.0;
    }
    for (long index = b->terms - 1; index >= 0; index--)
        total = total * travel + b->load[index];
    return total;
}

void run(const brake *b, long ticks, long steps, const double *reference, double *out)
{
    double position = 0.0, velocity = 0.0, integral = 0.0;
    for (long row = 0; row < ticks; row++) {
        double error = reference[2 * row] - position, rate = reference[2 * row + 1] - velocity;
        double wanted = b->proportional * error + b->derivative * rate + integral;
        double effort = fmin(b->limit, fmax(-b->limit, wanted));
        if (effort == wanted || (wanted - effort) * error < 0.0)
            integral += b->integral * error * b->tick;
        out[2 * row] = position;
        out[2 * row + 1] = velocity;
        for (long turn = 0; turn < steps; turn++) {
            double load = load_torque(b, position);
            double direction = fmin(1.0, fmax(-1.0, velocity / b->saturation));
            double level = b->coulomb + b->load_gain * fabs(load);
            double rest = b->viscous * velocity + load + level * direction;
            double drive = effort - (rest - level * direction);
            double fresh = (velocity + b->step * drive / b->inertia)
                / (1.0 + b->step * level / (b->inertia * b->saturation));
            if (fresh > b->saturation)
                fresh = fmax(b->saturation, velocity + b->step * (drive - level) / b->inertia);
            else if (fresh < -b->saturation)
                fresh = fmin(-b->saturation, velocity + b->step * (drive + level) / b->inertia);
            position += b->step * 0.5 * (velocity + fresh);
            velocity = fresh;
        }
    }
}
