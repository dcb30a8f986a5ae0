/* Servo as a co-simulation unit: the exact step of the plant, friction and contact laws, sampled controllers.
 *
 * The numbers (matrices, laws, controllers) stand in servo_data.h, written beside this file by toolpoint.io.fmu.unit.
 * Same algorithm as toolpoint.drives.simulation.kernel. Licence: that of toolpoint (BSD).
 */
#include <math.h>
#include <string.h>

#include "servo_data.h"

enum { CONTROL = 48, SLOTS = 18, SLIP = 8, VELOCITY = 16, SCRATCH = 17, ELEMENTS = 12, STIFFNESS = 13, SHARE = 21 };
enum { PASSES = 60, ITERATIONS = 60, INPUTS = 4, OUTPUTS = 13, TUNED = 4 };

typedef struct {
    long long at;
    long unconverged;
    double x[N], w[NW + 1], before[NW + 1], s[NS + 1], states[NL + 1][SLOTS], control[NA][CONTROL];
    double input[NA][INPUTS], parameters[NA][NPAR], y[NY], u[2 * NA];
} State;

/* ---- linear part ---- */

static void add_columns(const double *columns, int width, const double *x, int count, double *out) {
    for (int j = 0; j < count; j++) {
        const double a = x[j], *column = columns + (size_t)j * width;
        if (a != 0.0)
            for (int i = 0; i < width; i++) out[i] += column[i] * a;
    }
}

static void advance(const double *x, double *new_x) {
    memset(new_x, 0, N * sizeof(double));
    add_columns(core, CORE, x, CORE, new_x);
    for (int i = 0; i < HALF; i++) {
        const double a = x[CORE + i], b = x[CORE + HALF + i];
        new_x[CORE + i] = pairs[i] * a + pairs[HALF + i] * b;
        new_x[CORE + HALF + i] = pairs[2 * HALF + i] * a + pairs[3 * HALF + i] * b;
    }
}

static void read_outputs(State *q) {
    memset(q->y, 0, sizeof q->y);
    add_columns(reading, NY, q->x, N, q->y);
    add_columns(direct, NY, q->w, NW, q->y);
}

/* ---- friction and contact laws ---- */

static double dry(const double *row, double speed, double *slope) {
    double level = row[1];
    *slope = 0.0;
    for (int at = 2; at <= 5; at += 3) {
        const double a = row[at];
        if (a == 0.0) continue;
        const double ratio = speed / row[at + 1], d = row[at + 2];
        const double power = d == 2.0 ? ratio * ratio : (d == 1.0 ? ratio : pow(ratio, d));
        if (power > 60.0) continue;
        const double e = a * exp(-power);
        level += e;
        if (speed > 0.0) *slope -= e * d * power / speed;
    }
    return level;
}

static int narrowed(double *change, double s, double *low, double *high, double residual, double slope, double fixed) {
    /* Safeguarded Newton step: inside the bracket, else its middle, else one fixed-point step; 1 where nothing moves. */
    if (residual > 0.0) *high = fmin(*high, s);
    else *low = fmax(*low, s);
    *change = slope > 1e-6 ? -residual / slope : fixed - s;
    if (*low < s + *change && s + *change < *high) return 0;
    if (isfinite(*low) && isfinite(*high)) *change = 0.5 * (*low + *high) - s;
    else if (*change == 0.0) return 1;
    else *change = fixed - s;
    return 0;
}

static double bristle(const double *row, const double *state, double out_free, double gain, double guess, double *force,
                      double *trial, int *good) {
    const double s0 = row[9], s1 = row[10], s2 = row[8], half = 0.5 * STEP;
    double v = guess, low = -INFINITY, high = INFINITY, slope, change;
    for (int turn = 0; turn < ITERATIONS; turn++) {
        const double speed = fabs(v), sign = v >= 0.0 ? 1.0 : -1.0, g = dry(row, speed, &slope), over = 1.0 / g;
        const double share = s0 * speed * over, bottom = 1.0 / (1.0 + half * share);
        const double z = (state[0] + half * (state[1] + v)) * bottom;
        const double dshare = s0 * over * (sign - v * slope * over), dz = half * (1.0 - z * dshare) * bottom;
        const double rate = v - share * z, drate = 1.0 - dshare * z - share * dz;
        const double f = s0 * z + s1 * rate + s2 * v, df = s0 * dz + s1 * drate + s2;
        const int still = narrowed(&change, v, &low, &high, v - out_free - gain * f, 1.0 - gain * df, out_free + gain * f);
        const double near = fmax(1e-8 * (fabs(out_free) + fabs(gain * f)) + 1e-24,
                                 3e-5 * fmin(speed, fmin(row[3], row[6])));
        *force = f, trial[0] = z, trial[1] = rate;
        if (still) return v;
        if (fabs(change) <= near) {
            *force = f + df * change, trial[0] = z + dz * change, trial[1] = rate + drate * change;
            return v + change;
        }
        v += change;
    }
    *good = 0;
    return v;
}

static double held_still(const double *row, double out_free, double gain, double *force) {
    double slope;
    *force = 0.0;
    if (gain >= 0.0) return out_free;
    const double hold = -out_free / gain;
    if (fabs(hold) <= dry(row, 0.0, &slope)) {
        *force = hold;
        return 0.0;
    }
    const double sign = out_free > 0.0 ? 1.0 : -1.0;
    double low = 0.0, high = fabs(out_free), speed = high;
    for (int turn = 0; turn < ITERATIONS; turn++) {
        const double g = dry(row, speed, &slope), residual = speed - fabs(out_free) - gain * (g + row[8] * speed);
        if (residual > 0.0) high = speed;
        else low = speed;
        double trial = speed - residual / (1.0 - gain * (slope + row[8]));
        if (!(low <= trial && trial <= high)) trial = 0.5 * (low + high);
        if (fabs(trial - speed) <= 1e-13 * (speed + 1e-12)) break;
        speed = trial;
    }
    *force = sign * (dry(row, speed, &slope) + row[8] * speed);
    return sign * speed;
}

static double maxwell(const double *row, const double *state, double v, double *slope, double *trial) {
    double unused;
    const double level = dry(row, fabs(v), &unused), moved = 0.5 * STEP * (state[VELOCITY] + v);
    double total = row[8] * v;
    *slope = row[8];
    for (int i = 0; i < (int)row[ELEMENTS]; i++) {
        const double stiff = row[STIFFNESS + i], limit = row[SHARE + i] * level;
        double slip = state[SLIP + i], force;
        if (slip != 0.0 && v * slip > 0.0) {
            const double rise = STEP * row[11];
            force = slip * (fabs(state[i]) + rise * row[SHARE + i]) / (1.0 + rise / level);
        } else {
            slip = 0.0, force = state[i] + stiff * moved;
            if (fabs(force) >= limit) slip = force > 0.0 ? 1.0 : -1.0, force = slip * limit;
            else *slope += 0.5 * stiff * STEP;
        }
        trial[i] = force, trial[SLIP + i] = slip;
        total += force;
    }
    trial[VELOCITY] = v;
    return total;
}

static double contact(const double *row, double s, double *slope) {
    const double left = s + row[3], right = row[3] - s;
    *slope = row[2] - (left > 0.0 ? row[1] : 0.0) - (right > 0.0 ? row[1] : 0.0);
    return row[2] * s - row[1] * (fmax(left, 0.0) - fmax(right, 0.0));
}

static double solved(const double *row, const double *state, double out_free, double gain, double guess, double *value,
                     double *trial, int *good) {
    if (row[0] == 0.0) return held_still(row, out_free, gain, value);
    if (row[0] == 1.0) return bristle(row, state, out_free, gain, guess, value, trial, good);
    double s = guess, low = -INFINITY, high = INFINITY, slope, change;
    for (int turn = 0; turn < ITERATIONS; turn++) {
        *value = row[0] == 2.0 ? maxwell(row, state, s, &slope, trial) : contact(row, s, &slope);
        if (narrowed(&change, s, &low, &high, s - out_free - gain * *value, 1.0 - gain * slope, out_free + gain * *value))
            return s;
        if (fabs(change) <= 1e-8 * (fabs(out_free) + fabs(gain * *value)) + 1e-24) {
            *value += slope * change;
            return s + change;
        }
        s += change;
    }
    *good = 0;
    return s;
}

static double row_sum(const double *row, const double *w) {
    double total = 0.0;
    for (int j = 0; j < NW; j++) total += row[j] * w[j];
    return total;
}

static int implicit(State *q, const double *out_free, double trial[][SLOTS]) {
    int good = 1;
    double before = 1e-300;
    for (int turn = 0; turn < PASSES; turn++) {
        double change = 0.0, size = 0.0;
        for (int k = 0; k < NL; k++) {
            const double own = gain[k * NW + k], other = out_free[k] + row_sum(gain + k * NW, q->w) - own * q->w[k];
            if (turn && fabs(other - trial[k][SCRATCH]) <= 1e-10 * (fabs(other) + fabs(own * q->w[k]))) continue;
            trial[k][SCRATCH] = other;
            double value;
            q->s[k] = solved(rows + k * ROW, q->states[k], other, own, turn ? q->s[k] : other + own * q->w[k], &value,
                             trial[k], &good);
            change = fmax(change, fabs(value - q->w[k])), size = fmax(size, fabs(value));
            q->w[k] = value;
        }
        for (int k = 0; k < NP; k++) {
            for (int side = 0; side < 2; side++) {
                const int i = products[2 * k + side];
                q->s[i] = out_free[i] + row_sum(gain + i * NW, q->w);
            }
            const double value = q->s[products[2 * k]] * q->s[products[2 * k + 1]];
            change = fmax(change, fabs(value - q->w[NL + k])), size = fmax(size, fabs(value));
            q->w[NL + k] = value;
        }
        if (change * fmin(1.0, change / before) <= 1e-7 * size + 1e-15) return good;
        before = change;
    }
    return 0;
}

/* ---- sampled controllers ---- */

static double quantised(double value, double resolution) {
    return resolution == 0.0 ? value : floor(value / resolution + 0.5) * resolution;
}

static void position_sample(const double *p, double *s, const double *command, double angle, double scale) {
    const double actual = p[6] != 0.0 ? quantised(scale, p[8]) : quantised(angle, p[7]) * p[2];
    s[42] = command[0] - actual;
    s[0] = (p[0] * s[42] + p[1] * command[1]) / p[2];
    s[1] = p[3] * command[2] + p[4] * tanh(command[1] / p[5]);
}

static void velocity_sample(const double *p, double *s, double angle, double speed) {
    if (p[28] != 0.0) {
        const double reading_now = quantised(angle, p[7]);
        speed = (reading_now - s[6]) / p[26];
        s[6] = reading_now;
    }
    const double error = s[0] - speed;
    double torque = p[9] * error + s[2] + s[1];
    for (int i = 0; i < (int)p[24]; i++) {
        const double *b = p + 36 + 5 * i, y = b[0] * torque + s[8 + 2 * i];
        s[8 + 2 * i] = b[1] * torque - b[3] * y + s[9 + 2 * i];
        s[9 + 2 * i] = b[2] * torque - b[4] * y;
        torque = y;
    }
    const double limit = p[21] != 0.0 ? fmin(p[11], p[31] * p[12]) : p[11], limited = fmin(fmax(torque, -limit), limit);
    if (limited == torque || error * torque < 0.0) s[2] += p[10] * p[26] * error;
    const int delay = (int)p[22];
    for (int i = delay; i > 0; i--) s[16 + i] = s[15 + i];
    s[16] = limited;
    s[7] = s[16 + delay];
    s[3] = s[7] / p[12];
}

static void current_sample(const double *p, double *s, double angle, double speed, double i_d, double i_q) {
    if (p[21] == 0.0) {
        s[40] = 0.0, s[41] = s[7];
        return;
    }
    const double turn = p[19] * speed, error_d = -i_d, error_q = s[3] - i_q;
    double u_d = p[13] * error_d + s[4], u_q = p[13] * error_q + s[5];
    if (p[15] != 0.0) u_d -= turn * p[17] * i_q, u_q += turn * (p[16] * i_d + p[18]);
    const double length = sqrt(u_d * u_d + u_q * u_q), scale = length > p[20] ? p[20] / length : 1.0;
    const double back = p[27] * p[14] / p[13];
    s[4] += p[27] * p[14] * error_d + back * (scale - 1.0) * u_d;
    s[5] += p[27] * p[14] * error_q + back * (scale - 1.0) * u_q;
    const int delay = (int)p[23];
    for (int i = delay; i > 0; i--) s[24 + i] = s[23 + i], s[32 + i] = s[31 + i];
    s[24] = scale * u_d, s[32] = scale * u_q;
    s[40] = s[24 + delay], s[41] = s[32 + delay];
    s[43] = angle, s[44] = speed;
}

static double leg(double level, double bus, double start, double stop) {
    const double duty = fmin(fmax(0.5 + level / bus, 0.0), 1.0), low = 0.5 - 0.5 * duty, high = 0.5 + 0.5 * duty;
    return bus * fmax(0.0, fmin(stop, high) - fmax(start, low)) / (stop - start);
}

static void switched(const double *p, const double *s, double phase, double width, double angle, double speed, double *u) {
    const double poles = p[32], period = p[27], bus = sqrt(3.0) * p[20], at = poles * (s[43] + 0.5 * period * s[44]);
    const double root = 0.5 * sqrt(3.0), alpha = cos(at) * s[40] - sin(at) * s[41], beta = sin(at) * s[40] + cos(at) * s[41];
    const double a = alpha, b = -0.5 * alpha + root * beta, d = -0.5 * alpha - root * beta;
    const double middle = 0.5 * (fmax(a, fmax(b, d)) + fmin(a, fmin(b, d)));
    const double start = fmax(phase * p[30] - floor(phase * p[30] + 1e-9), 0.0), stop = start + width * p[30];
    const double high_a = leg(a - middle, bus, start, stop), high_b = leg(b - middle, bus, start, stop);
    const double high_d = leg(d - middle, bus, start, stop);
    const double mean_alpha = (2.0 * high_a - high_b - high_d) / 3.0, mean_beta = (high_b - high_d) / sqrt(3.0);
    const double now = poles * (angle + 0.5 * width * period * speed), c = cos(now), q = sin(now);
    u[0] = c * mean_alpha + q * mean_beta, u[1] = -q * mean_alpha + c * mean_beta;
}

static void controllers(State *q) {
    for (int i = 0; i < NA; i++) {
        const double *p = q->parameters[i], *y = q->y + 7 * i;
        double *s = q->control[i];
        if (q->at % COUNT_CURRENT == 0) {
            if (q->at % COUNT_POSITION == 0) position_sample(p, s, q->input[i], y[0], y[2]);
            if (q->at % COUNT_VELOCITY == 0) velocity_sample(p, s, y[0], y[1]);
            current_sample(p, s, y[0], y[1], y[3], y[4]);
        }
        if (p[29] != 0.0)
            switched(p, s, (double)(q->at % COUNT_CURRENT) / COUNT_CURRENT, 1.0 / COUNT_CURRENT, y[0], y[1], q->u + 2 * i);
        else
            q->u[2 * i] = s[40], q->u[2 * i + 1] = s[41];
    }
}

/* ---- one step of the plant ---- */

static void plant_step(State *q) {
    double drive[ND] = {0}, new_x[N], out_free[NS + 1] = {0}, trial[NL + 1][SLOTS];
    controllers(q);
    memcpy(drive, q->u, sizeof q->u);
    for (int i = 0; i < NA; i++) drive[2 * NA + i] = q->input[i][3];
    for (int k = 0; k < NW; k++) drive[3 * NA + k] = q->w[k];
    advance(q->x, new_x);
    add_columns(inputs, N, drive, ND, new_x);
    memcpy(q->x, new_x, sizeof new_x);
    add_columns(scalars, NS, q->x, N, out_free);
    for (int k = 0; k < NW; k++) {
        const double old = q->w[k];
        q->w[k] = 2.0 * old - q->before[k], q->before[k] = old;
    }
    memset(trial, 0, sizeof trial);
    if (!implicit(q, out_free, trial)) q->unconverged++;
    for (int k = 0; k < NL; k++) {
        const double kind = rows[k * ROW];
        if (kind == 1.0) memcpy(q->states[k], trial[k], 2 * sizeof(double));
        if (kind == 2.0) memcpy(q->states[k], trial[k], SCRATCH * sizeof(double));
    }
    add_columns(jump, N, q->w, NW, q->x);
    q->at++;
    read_outputs(q);
}

static void at_rest(State *q) {
    memset(q, 0, sizeof *q);
    memcpy(q->parameters, parameters, sizeof q->parameters);
}
