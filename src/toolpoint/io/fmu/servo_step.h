/* Servo as a co-simulation unit: the exact step of the plant, friction and contact laws, sampled controllers.
 *
 * The numbers (matrices, laws, controllers) stand in servo_data.h and the structs that hold them in servo_records.h, both
 * written beside this file by toolpoint.io.fmu.
 * Same algorithm as toolpoint.drives.simulation.kernel. Licence: that of toolpoint (BSD).
 */
#include <math.h>
#include <string.h>

#include "servo_records.h"

#include "servo_data.h"

typedef struct {
    long long at;
    long unconverged;
    double x[N], w[NW + 1], before[NW + 1], s[NS + 1], y[NY], u[2 * NA];
    LawState states[NL + 1];
    ControlState control[NA];
    Input input[NA];
    Parameters parameters[NA];
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

static double dry(const Law *law, double speed, double *slope) {
    double level = law->level;
    *slope = 0.0;
    for (int i = 0; i < 2; i++) {
        const double a = law->fall_size[i];
        if (a == 0.0) continue;
        const double ratio = speed / law->fall_velocity[i], d = law->fall_exponent[i];
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

static double bristle(const Law *law, const LawState *state, double out_free, double gain, double guess, double *force,
                      LawState *trial, int *good) {
    const double s0 = law->bristle_stiffness, s1 = law->bristle_damping, s2 = law->viscous, half = 0.5 * STEP;
    double v = guess, low = -INFINITY, high = INFINITY, slope, change;
    for (int turn = 0; turn < MAX_LAW_ITERATIONS; turn++) {
        const double speed = fabs(v), sign = v >= 0.0 ? 1.0 : -1.0, g = dry(law, speed, &slope), over = 1.0 / g;
        const double share = s0 * speed * over, bottom = 1.0 / (1.0 + half * share);
        const double z = (state->bristle + half * (state->bristle_rate + v)) * bottom;
        const double dshare = s0 * over * (sign - v * slope * over), dz = half * (1.0 - z * dshare) * bottom;
        const double rate = v - share * z, drate = 1.0 - dshare * z - share * dz;
        const double f = s0 * z + s1 * rate + s2 * v, df = s0 * dz + s1 * drate + s2;
        const int still = narrowed(&change, v, &low, &high, v - out_free - gain * f, 1.0 - gain * df, out_free + gain * f);
        const double near = fmax(1e-8 * (fabs(out_free) + fabs(gain * f)) + 1e-24,
                                 3e-5 * fmin(speed, fmin(law->fall_velocity[0], law->fall_velocity[1])));
        *force = f, trial->bristle = z, trial->bristle_rate = rate;
        if (still) return v;
        if (fabs(change) <= near) {
            *force = f + df * change, trial->bristle = z + dz * change, trial->bristle_rate = rate + drate * change;
            return v + change;
        }
        v += change;
    }
    *good = 0;
    return v;
}

static double held_still(const Law *law, double out_free, double gain, double *force) {
    double slope;
    *force = 0.0;
    if (gain >= 0.0) return out_free;
    const double hold = -out_free / gain;
    if (fabs(hold) <= dry(law, 0.0, &slope)) {
        *force = hold;
        return 0.0;
    }
    const double sign = out_free > 0.0 ? 1.0 : -1.0;
    double low = 0.0, high = fabs(out_free), speed = high;
    for (int turn = 0; turn < MAX_LAW_ITERATIONS; turn++) {
        const double g = dry(law, speed, &slope), residual = speed - fabs(out_free) - gain * (g + law->viscous * speed);
        if (residual > 0.0) high = speed;
        else low = speed;
        double trial = speed - residual / (1.0 - gain * (slope + law->viscous));
        if (!(low <= trial && trial <= high)) trial = 0.5 * (low + high);
        if (fabs(trial - speed) <= 1e-13 * (speed + 1e-12)) break;
        speed = trial;
    }
    *force = sign * (dry(law, speed, &slope) + law->viscous * speed);
    return sign * speed;
}

static double maxwell(const Law *law, const LawState *state, double v, double *slope, LawState *trial) {
    double unused;
    const double level = dry(law, fabs(v), &unused), moved = 0.5 * STEP * (state->velocity + v);
    double total = law->viscous * v;
    *slope = law->viscous;
    for (int i = 0; i < law->elements; i++) {
        const double stiff = law->element_stiffness[i], limit = law->element_share[i] * level;
        double slip = state->block_slip[i], force;
        if (slip != 0.0 && v * slip > 0.0) {
            const double rise = STEP * law->attraction;
            force = slip * (fabs(state->block_force[i]) + rise * law->element_share[i]) / (1.0 + rise / level);
        } else {
            slip = 0.0, force = state->block_force[i] + stiff * moved;
            if (fabs(force) >= limit) slip = force > 0.0 ? 1.0 : -1.0, force = slip * limit;
            else *slope += 0.5 * stiff * STEP;
        }
        trial->block_force[i] = force, trial->block_slip[i] = slip;
        total += force;
    }
    trial->velocity = v;
    return total;
}

static double contact(const Law *law, double s, double *slope) {
    const double left = s + law->contact_preload, right = law->contact_preload - s, stiff = law->contact_stiffness;
    const double cubic = law->contact_cubic * s * s;
    *slope = law->contact_reference - (left > 0.0 ? stiff : 0.0) - (right > 0.0 ? stiff : 0.0) - 3.0 * cubic;
    return law->contact_reference * s - stiff * (fmax(left, 0.0) - fmax(right, 0.0)) - cubic * s;
}

static double solve_law(const Law *law, const LawState *state, double out_free, double gain, double guess, double *value,
                        LawState *trial, int *good) {
    if (law->kind == STATIC) return held_still(law, out_free, gain, value);
    if (law->kind == BRISTLE) return bristle(law, state, out_free, gain, guess, value, trial, good);
    double s = guess, low = -INFINITY, high = INFINITY, slope, change;
    for (int turn = 0; turn < MAX_LAW_ITERATIONS; turn++) {
        *value = law->kind == MAXWELL ? maxwell(law, state, s, &slope, trial) : contact(law, s, &slope);
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

/* Laws of this step: those that a load presses have load_arm |load| on top of their level. */
static void press(const State *q, Law pressed[]) {
    memcpy(pressed, laws, NL * sizeof(Law));
    if (LOADED) {
        double load[NL + 1] = {0};
        add_columns(loads, NL, q->x, N, load);
        add_columns(load_direct, NL, q->w, NW, load);
        for (int k = 0; k < NL; k++) pressed[k].level += pressed[k].load_arm * fabs(load[k]);
    }
}

static int implicit(State *q, const Law *pressed, const double *out_free, LawState trial[]) {
    int good = 1;
    double before = 1e-300;
    for (int turn = 0; turn < MAX_LAW_PASSES; turn++) {
        double change = 0.0, size = 0.0;
        for (int k = 0; k < NL; k++) {
            const double own = gain[k * NW + k], other = out_free[k] + row_sum(gain + k * NW, q->w) - own * q->w[k];
            if (turn && fabs(other - trial[k].surroundings) <= 1e-10 * (fabs(other) + fabs(own * q->w[k]))) continue;
            trial[k].surroundings = other;
            double value;
            q->s[k] = solve_law(&pressed[k], &q->states[k], other, own, turn ? q->s[k] : other + own * q->w[k], &value,
                                &trial[k], &good);
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

static void position_sample(const Parameters *p, ControlState *s, const Input *set_point, double angle, double scale) {
    const double actual = p->scale_feedback ? quantised(scale, p->scale_resolution) : quantised(angle, p->angle_resolution) * p->lead;
    s->following_error = set_point->position - actual;
    s->speed_set = (p->position_gain * s->following_error + p->velocity_feedforward * set_point->velocity) / p->lead;
    s->torque_feedforward = p->inertia_feedforward * set_point->acceleration
                            + p->friction_feedforward * tanh(set_point->velocity / p->friction_velocity);
}

static void velocity_sample(const Parameters *p, ControlState *s, double angle, double speed, double place) {
    if (p->difference) {
        const double reading_now = quantised(angle, p->angle_resolution);
        speed = (reading_now - s->last_angle) / p->velocity_sample_time;
        s->last_angle = reading_now;
    }
    const double error = s->speed_set - speed;
    double torque = p->velocity_gain * error + s->speed_integral + s->torque_feedforward;
    if (p->damping_gain != 0.0) {
        const double stretch = (p->damps_tool ? place : quantised(place, p->scale_resolution)) / p->lead
                               - quantised(angle, p->angle_resolution);
        torque += p->damping_gain * (stretch - s->last_stretch) / p->velocity_sample_time;
        s->last_stretch = stretch;
    }
    for (int i = 0; i < p->filter_count; i++) {
        const double y = p->filter_b0[i] * torque + s->filter_first[i];
        s->filter_first[i] = p->filter_b1[i] * torque - p->filter_a1[i] * y + s->filter_second[i];
        s->filter_second[i] = p->filter_b2[i] * torque - p->filter_a2[i] * y;
        torque = y;
    }
    const double limit = p->has_current_loop ? fmin(p->torque_limit, p->current_limit * p->torque_constant) : p->torque_limit;
    const double limited = fmin(fmax(torque, -limit), limit);
    if (limited == torque || error * torque < 0.0) s->speed_integral += p->velocity_integral * p->velocity_sample_time * error;
    for (int i = (int)p->velocity_delay; i > 0; i--) s->torque_line[i] = s->torque_line[i - 1];
    s->torque_line[0] = limited;
    s->torque_set = s->torque_line[p->velocity_delay];
    s->current_set = s->torque_set / p->torque_constant;
}

static void current_sample(const Parameters *p, ControlState *s, double angle, double speed, double i_d, double i_q) {
    if (!p->has_current_loop) {
        s->voltage_d = 0.0, s->voltage_q = s->torque_set;
        return;
    }
    const double turn = p->model_pole_pairs * speed, error_d = -i_d, error_q = s->current_set - i_q;
    double u_d = p->current_gain * error_d + s->integral_d, u_q = p->current_gain * error_q + s->integral_q;
    if (p->decoupling) {
        u_d -= turn * p->model_inductance_q * i_q;
        u_q += turn * (p->model_inductance_d * i_d + p->model_flux);
    }
    const double length = sqrt(u_d * u_d + u_q * u_q), scale = length > p->voltage_limit ? p->voltage_limit / length : 1.0;
    const double rise = p->current_sample_time * p->current_integral, back = rise / p->current_gain;
    s->integral_d += rise * error_d + back * (scale - 1.0) * u_d;
    s->integral_q += rise * error_q + back * (scale - 1.0) * u_q;
    for (int i = (int)p->current_delay; i > 0; i--) {
        s->voltage_line_d[i] = s->voltage_line_d[i - 1];
        s->voltage_line_q[i] = s->voltage_line_q[i - 1];
    }
    s->voltage_line_d[0] = scale * u_d, s->voltage_line_q[0] = scale * u_q;
    s->voltage_d = s->voltage_line_d[p->current_delay], s->voltage_q = s->voltage_line_q[p->current_delay];
    s->held_angle = angle, s->held_speed = speed;
}

static double leg(double level, double bus, double start, double stop) {
    const double duty = fmin(fmax(0.5 + level / bus, 0.0), 1.0), low = 0.5 - 0.5 * duty, high = 0.5 + 0.5 * duty;
    return bus * fmax(0.0, fmin(stop, high) - fmax(start, low)) / (stop - start);
}

static void switched(const Parameters *p, const ControlState *s, double phase, double width, double angle, double speed, double *u) {
    const double poles = p->pole_pairs, period = p->current_sample_time, bus = sqrt(3.0) * p->voltage_limit;
    const double at = poles * (s->held_angle + 0.5 * period * s->held_speed);
    const double root = 0.5 * sqrt(3.0);
    const double alpha = cos(at) * s->voltage_d - sin(at) * s->voltage_q;
    const double beta = sin(at) * s->voltage_d + cos(at) * s->voltage_q;
    const double a = alpha, b = -0.5 * alpha + root * beta, d = -0.5 * alpha - root * beta;
    const double middle = 0.5 * (fmax(a, fmax(b, d)) + fmin(a, fmin(b, d)));
    const double start = fmax(phase * p->carrier - floor(phase * p->carrier + 1e-9), 0.0), stop = start + width * p->carrier;
    const double high_a = leg(a - middle, bus, start, stop), high_b = leg(b - middle, bus, start, stop);
    const double high_d = leg(d - middle, bus, start, stop);
    const double mean_alpha = (2.0 * high_a - high_b - high_d) / 3.0, mean_beta = (high_b - high_d) / sqrt(3.0);
    const double now = poles * (angle + 0.5 * width * period * speed), c = cos(now), q = sin(now);
    u[0] = c * mean_alpha + q * mean_beta, u[1] = -q * mean_alpha + c * mean_beta;
}

static void controllers(State *q) {
    for (int i = 0; i < NA; i++) {
        const Parameters *p = &q->parameters[i];
        const double *y = q->y + OUTPUTS * i, angle = y[OUTPUT_angle], speed = y[OUTPUT_speed];
        ControlState *s = &q->control[i];
        if (q->at % COUNT_CURRENT == 0) {
            if (q->at % COUNT_POSITION == 0) position_sample(p, s, &q->input[i], angle, y[OUTPUT_scale]);
            if (q->at % COUNT_VELOCITY == 0) 
                velocity_sample(p, s, angle, speed, p->damps_tool ? y[OUTPUT_tool] : y[OUTPUT_scale]);
            current_sample(p, s, angle, speed, y[OUTPUT_i_d], y[OUTPUT_i_q]);
        }
        if (p->six_pulse)
            switched(p, s, (double)(q->at % COUNT_CURRENT) / COUNT_CURRENT, 1.0 / COUNT_CURRENT, angle, speed, q->u + 2 * i);
        else
            q->u[2 * i] = s->voltage_d, q->u[2 * i + 1] = s->voltage_q;
    }
}

/* ---- one step of the plant ---- */

static void plant_step(State *q) {
    double drive[ND] = {0}, new_x[N], out_free[NS + 1] = {0};
    LawState trial[NL + 1];
    Law pressed[NL + 1];
    controllers(q);
    memcpy(drive, q->u, sizeof q->u);
    for (int i = 0; i < NA; i++) drive[2 * NA + i] = q->input[i].load;
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
    press(q, pressed);
    if (!implicit(q, pressed, out_free, trial)) q->unconverged++;
    for (int k = 0; k < NL; k++) {
        if (laws[k].kind == BRISTLE) {
            q->states[k].bristle = trial[k].bristle;
            q->states[k].bristle_rate = trial[k].bristle_rate;
        } else if (laws[k].kind == MAXWELL)
            q->states[k] = trial[k];
    }
    add_columns(jump, N, q->w, NW, q->x);
    q->at++;
    read_outputs(q);
}

static void at_rest(State *q) {
    memset(q, 0, sizeof *q);
    memcpy(q->parameters, parameters, sizeof q->parameters);
}
