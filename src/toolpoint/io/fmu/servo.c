/* Servo as a co-simulation unit of FMI 2.0: the functions of the standard around the step of servo_step.h.
 *
 * The declarations follow the FMI 2.0 standard's text, no header of it is needed. Licence: that of toolpoint (BSD).
 */
#include <stdio.h>
#include <stdlib.h>

#include "servo_step.h"

#if defined(_WIN32)
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

typedef void *fmi2Component;
typedef void *fmi2FMUstate;
typedef unsigned int fmi2ValueReference;
typedef double fmi2Real;
typedef int fmi2Integer;
typedef int fmi2Boolean;
typedef const char *fmi2String;
typedef char fmi2Byte;
typedef enum { fmi2OK, fmi2Warning, fmi2Discard, fmi2Error, fmi2Fatal, fmi2Pending } fmi2Status;
typedef enum { fmi2ModelExchange, fmi2CoSimulation } fmi2Type;
typedef enum { fmi2DoStepStatus, fmi2PendingStatus, fmi2LastSuccessfulTime, fmi2Terminated } fmi2StatusKind;
typedef struct {
    void (*logger)(void *, fmi2String, fmi2Status, fmi2String, fmi2String, ...);
    void *(*allocateMemory)(size_t, size_t);
    void (*freeMemory)(void *);
    void (*stepFinished)(void *, fmi2Status);
    void *environment;
} fmi2CallbackFunctions;

typedef struct {
    State state;
    double start;
    fmi2CallbackFunctions callbacks;
    char name[256];
} Servo;

static void say(Servo *servo, fmi2Status status, const char *text) {
    if (servo->callbacks.logger)
        servo->callbacks.logger(servo->callbacks.environment, servo->name, status, "logStatusError", text);
}

static double *input_of(Input *input, unsigned at) {
    switch (at) {
    case INPUT_position: return &input->position;
    case INPUT_velocity: return &input->velocity;
    case INPUT_acceleration: return &input->acceleration;
    case INPUT_load: return &input->load;
    default: return NULL;
    }
}

static double *signal_of(ControlState *control, double *voltage, unsigned at) {
    switch (at) {
    case SIGNAL_speed_set: return &control->speed_set;
    case SIGNAL_torque_set: return &control->torque_set;
    case SIGNAL_current_set: return &control->current_set;
    case SIGNAL_u_d: return &voltage[0];
    case SIGNAL_u_q: return &voltage[1];
    case SIGNAL_following_error: return &control->following_error;
    default: return NULL;
    }
}

static double *tunable_of(Parameters *p, unsigned at) {
    switch (at) {
    case TUNED_position_gain: return &p->position_gain;
    case TUNED_velocity_feedforward: return &p->velocity_feedforward;
    case TUNED_velocity_gain: return &p->velocity_gain;
    case TUNED_velocity_integral: return &p->velocity_integral;
    default: return NULL;
    }
}

static double *place(Servo *servo, fmi2ValueReference at) {
    /* Axis by axis: inputs, outputs of the plant, signals of the controller, then the parameters that may be set. */
    const unsigned axis = at / AXIS_REFERENCES, kind = at % AXIS_REFERENCES;
    State *q = &servo->state;
    if (axis >= NA) return NULL;
    if (kind < FIRST_OUTPUT) return input_of(&q->input[axis], kind);
    if (kind < FIRST_OUTPUT + OUTPUTS) return &q->y[OUTPUTS * axis + kind - FIRST_OUTPUT];
    if (kind < FIRST_TUNED) return signal_of(&q->control[axis], q->u + 2 * axis, kind - FIRST_OUTPUT - OUTPUTS);
    return tunable_of(&q->parameters[axis], kind - FIRST_TUNED);
}

EXPORT const char *fmi2GetTypesPlatform(void) { return "default"; }
EXPORT const char *fmi2GetVersion(void) { return "2.0"; }
EXPORT fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String names[]) {
    (void)c, (void)on, (void)n, (void)names;
    return fmi2OK;
}

EXPORT fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                                     const fmi2CallbackFunctions *callbacks, fmi2Boolean visible, fmi2Boolean logging) {
    (void)resources, (void)visible, (void)logging;
    if (type != fmi2CoSimulation || guid == NULL || strcmp(guid, GUID) != 0) return NULL;
    Servo *servo = calloc(1, sizeof *servo);
    if (servo == NULL) return NULL;
    if (callbacks) servo->callbacks = *callbacks;
    snprintf(servo->name, sizeof servo->name, "%s", name ? name : "servo");
    at_rest(&servo->state);
    return servo;
}

EXPORT void fmi2FreeInstance(fmi2Component c) { free(c); }
EXPORT fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean tolerance_given, fmi2Real tolerance, fmi2Real start,
                                      fmi2Boolean stop_given, fmi2Real stop) {
    (void)tolerance_given, (void)tolerance, (void)stop_given, (void)stop;
    ((Servo *)c)->start = start;
    return fmi2OK;
}
EXPORT fmi2Status fmi2EnterInitializationMode(fmi2Component c) { (void)c; return fmi2OK; }
EXPORT fmi2Status fmi2ExitInitializationMode(fmi2Component c) { (void)c; return fmi2OK; }
EXPORT fmi2Status fmi2Terminate(fmi2Component c) { (void)c; return fmi2OK; }
EXPORT fmi2Status fmi2Reset(fmi2Component c) { at_rest(&((Servo *)c)->state); return fmi2OK; }

EXPORT fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference at[], size_t n, fmi2Real value[]) {
    for (size_t i = 0; i < n; i++) {
        const double *number = place(c, at[i]);
        if (number == NULL) return say(c, fmi2Error, "fmi2GetReal: unknown value reference"), fmi2Error;
        value[i] = *number;
    }
    return fmi2OK;
}

EXPORT fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference at[], size_t n, const fmi2Real value[]) {
    for (size_t i = 0; i < n; i++) {
        const unsigned kind = at[i] % AXIS_REFERENCES;
        double *number = kind < INPUTS || kind >= FIRST_TUNED ? place(c, at[i]) : NULL;
        if (number == NULL || !isfinite(value[i]))
            return say(c, fmi2Error, "fmi2SetReal: not an input or a parameter, or a value that is not finite"), fmi2Error;
        *number = value[i];
    }
    return fmi2OK;
}

EXPORT fmi2Status fmi2DoStep(fmi2Component c, fmi2Real now, fmi2Real size, fmi2Boolean no_set_before) {
    (void)no_set_before;
    Servo *servo = c;
    const double steps = size / STEP, from = (now - servo->start) / STEP;
    const long long count = llround(steps);
    if (count < 1 || fabs(steps - (double)count) > 1e-6 * fmax(1.0, steps)) {
        say(servo, fmi2Error, "fmi2DoStep: the communication step must be a whole multiple of the unit's step, " STEP_TEXT " s");
        return fmi2Error;
    }
    if (llround(from) != servo->state.at) {
        say(servo, fmi2Error, "fmi2DoStep: the time is not the end of the step before; reset the unit or restore a state");
        return fmi2Error;
    }
    for (long long k = 0; k < count; k++) plant_step(&servo->state);
    for (int i = 0; i < NY; i++)
        if (!isfinite(servo->state.y[i])) {
            say(servo, fmi2Error, "fmi2DoStep: the motion is not finite; the loops are unstable with these values");
            return fmi2Error;
        }
    if (servo->state.unconverged) say(servo, fmi2Warning, "fmi2DoStep: a step's implicit equations did not converge");
    return servo->state.unconverged ? (servo->state.unconverged = 0, fmi2Warning) : fmi2OK;
}

EXPORT fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *out) {
    if (*out == NULL) *out = malloc(sizeof(State));
    if (*out == NULL) return fmi2Error;
    memcpy(*out, &((Servo *)c)->state, sizeof(State));
    return fmi2OK;
}
EXPORT fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate from) {
    memcpy(&((Servo *)c)->state, from, sizeof(State));
    return fmi2OK;
}
EXPORT fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state) {
    (void)c;
    free(*state);
    *state = NULL;
    return fmi2OK;
}
EXPORT fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size) {
    (void)c, (void)state;
    *size = sizeof(State);
    return fmi2OK;
}
EXPORT fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size) {
    (void)c;
    if (size < sizeof(State)) return fmi2Error;
    memcpy(bytes, state, sizeof(State));
    return fmi2OK;
}
EXPORT fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state) {
    (void)c;
    if (size < sizeof(State)) return fmi2Error;
    if (*state == NULL) *state = malloc(sizeof(State));
    if (*state == NULL) return fmi2Error;
    memcpy(*state, bytes, sizeof(State));
    return fmi2OK;
}

/* What the unit has not: no integers, booleans, strings, derivatives or pending steps. */
#define REFUSED(name, ...) \
    EXPORT fmi2Status name(fmi2Component c, __VA_ARGS__) { say(c, fmi2Error, #name " is not offered"); return fmi2Error; }
#define NONE_OF(name, type) \
    EXPORT fmi2Status name(fmi2Component c, const fmi2ValueReference at[], size_t n, type value[]) { \
        (void)at, (void)value; \
        return n == 0 ? fmi2OK : (say(c, fmi2Error, #name ": no such variable"), fmi2Error); \
    }
NONE_OF(fmi2GetInteger, fmi2Integer)
NONE_OF(fmi2GetBoolean, fmi2Boolean)
NONE_OF(fmi2GetString, fmi2String)
NONE_OF(fmi2SetInteger, const fmi2Integer)
NONE_OF(fmi2SetBoolean, const fmi2Boolean)
NONE_OF(fmi2SetString, const fmi2String)
REFUSED(fmi2GetDirectionalDerivative, const fmi2ValueReference a[], size_t n, const fmi2ValueReference b[], size_t m,
        const fmi2Real d[], fmi2Real out[])
REFUSED(fmi2SetRealInputDerivatives, const fmi2ValueReference at[], size_t n, const fmi2Integer order[], const fmi2Real v[])
REFUSED(fmi2GetRealOutputDerivatives, const fmi2ValueReference at[], size_t n, const fmi2Integer order[], fmi2Real v[])
REFUSED(fmi2GetStatus, const fmi2StatusKind kind, fmi2Status *value)
REFUSED(fmi2GetRealStatus, const fmi2StatusKind kind, fmi2Real *value)
REFUSED(fmi2GetIntegerStatus, const fmi2StatusKind kind, fmi2Integer *value)
REFUSED(fmi2GetBooleanStatus, const fmi2StatusKind kind, fmi2Boolean *value)
REFUSED(fmi2GetStringStatus, const fmi2StatusKind kind, fmi2String *value)
EXPORT fmi2Status fmi2CancelStep(fmi2Component c) { (void)c; return fmi2Error; }
