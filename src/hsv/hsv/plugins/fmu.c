/* A block of hsv_block.h as an FMU for co-simulation, FMI 3.0. fmu_block.h, which is written at the export, includes
 * the source of the block and defines its sizes.
 *
 * Value references count the inputs, the parameters and the outputs of the block in this order; the last one is time.
 * fmi3DoStep steps the block once for each control period with the present inputs, and sets the outputs. A block with
 * FMU_STEP_AT_START is also stepped when its initialisation begins, which sets the outputs at the start.
 *
 * No heap is used: instances and saved states lie in static arrays. A saved state contains no pointers, so that its
 * bytes can be restored in another process. */
#include "fmu_block.h"

#include "fmi3Functions.h"
#include <string.h>

enum {
    FMU_INSTANCES = 16,
    FMU_SAVED = 64,
    FMU_GIVEN = FMU_INPUTS + FMU_PARAMETERS,
    FMU_TIME = FMU_GIVEN + FMU_OUTPUTS
};

typedef struct {
    double start, values[FMU_TIME], state[FMU_STATE];
    int64_t k, begun; /* number of the next step; whether the instance is initialised */
} FmuMemory;

typedef struct {
    FmuMemory memory;
    fmi3InstanceEnvironment environment;
    fmi3LogMessageCallback log;
    int used;
} FmuInstance; /* also a saved state, which uses only "memory" */

static FmuInstance instances[FMU_INSTANCES], saved_states[FMU_SAVED];

/* Return whether the array element was free, and mark it as used; several threads may call this at the same time. */
static int take(int *used) { return !__atomic_exchange_n(used, 1, __ATOMIC_ACQ_REL); }

static fmi3Status fail(const FmuInstance *instance, const char *message)
{
    if (instance && instance->log) instance->log(instance->environment, fmi3Error, "logStatusError", message);
    return fmi3Error;
}

static void restart(FmuMemory *memory)
{
    memset(memory, 0, sizeof *memory);
    memcpy(memory->values, fmu_start_values, FMU_GIVEN * sizeof *memory->values);
}

static int32_t step(FmuMemory *memory)
{
    double *in = memory->values;
    return FMU_BLOCK.step(memory->k++, in, in + FMU_GIVEN, memory->state, in + FMU_INPUTS);
}

const char *fmi3GetVersion(void) { return fmi3Version; }

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                         fmi3Boolean logging, fmi3Boolean events, fmi3Boolean early_return,
                                         const fmi3ValueReference required[], size_t n,
                                         fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
                                         fmi3IntermediateUpdateCallback update)
{
    FmuInstance caller = {.environment = environment, .log = log};
    (void)name, (void)resources, (void)visible, (void)logging, (void)events, (void)early_return;
    (void)required, (void)n, (void)update;
    if (!token || strcmp(token, FMU_TOKEN) != 0) {
        fail(&caller, "instantiationToken: expected that of modelDescription.xml");
        return NULL;
    }
    for (int i = 0; i < FMU_INSTANCES; i++)
        if (take(&instances[i].used)) {
            restart(&instances[i].memory);
            instances[i].environment = environment;
            instances[i].log = log;
            return &instances[i];
        }
    fail(&caller, "no room for another instance, expected at most 16");
    return NULL;
}

void fmi3FreeInstance(fmi3Instance instance)
{
    if (instance) __atomic_store_n(&((FmuInstance *)instance)->used, 0, __ATOMIC_RELEASE);
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean tolerance_defined, fmi3Float64 tolerance,
                                       fmi3Float64 start, fmi3Boolean stop_defined, fmi3Float64 stop)
{
    FmuMemory *memory = &((FmuInstance *)instance)->memory;
    (void)tolerance_defined, (void)tolerance, (void)stop_defined, (void)stop;
    memory->start = start;
    if (FMU_STEP_AT_START && step(memory)) return fail(instance, "the block failed in step 0");
    return fmi3OK;
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance instance)
{
    ((FmuInstance *)instance)->memory.begun = 1;
    return fmi3OK;
}

fmi3Status fmi3Reset(fmi3Instance instance)
{
    restart(&((FmuInstance *)instance)->memory);
    return fmi3OK;
}

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 now, fmi3Float64 length, fmi3Boolean no_set_state,
                      fmi3Boolean *event, fmi3Boolean *terminate, fmi3Boolean *early_return, fmi3Float64 *last)
{
    FmuMemory *memory = &((FmuInstance *)instance)->memory;
    const double periods = length / FMU_PERIOD + 0.5;
    const int64_t count = periods >= 1.0 && periods < 1e9 ? (int64_t)periods : 0;
    const double off = length - (double)count * FMU_PERIOD;
    (void)no_set_state;
    *event = *terminate = *early_return = fmi3False;
    *last = now;
    if (!memory->begun) return fail(instance, "fmi3DoStep: not initialised");
    if (count == 0 || off > 1e-6 * FMU_PERIOD || off < -1e-6 * FMU_PERIOD)
        return fail(instance, "communicationStepSize: expected a whole number of control periods");
    for (int64_t i = 0; i < count; i++)
        if (step(memory)) return fail(instance, "fmi3DoStep: the block failed");
    *last = now + length;
    return fmi3OK;
}

fmi3Status fmi3GetFloat64(fmi3Instance instance, const fmi3ValueReference references[], size_t n, fmi3Float64 values[],
                          size_t count)
{
    const FmuMemory *memory = &((FmuInstance *)instance)->memory;
    const int64_t stepped = memory->k - (memory->k > 0 ? FMU_STEP_AT_START : 0);
    if (n != count) return fail(instance, "fmi3GetFloat64: expected a value for each reference");
    for (size_t i = 0; i < n; i++) {
        if (references[i] > FMU_TIME) return fail(instance, "fmi3GetFloat64: no such variable");
        values[i] =
            references[i] == FMU_TIME ? memory->start + (double)stepped * FMU_PERIOD : memory->values[references[i]];
    }
    return fmi3OK;
}

fmi3Status fmi3SetFloat64(fmi3Instance instance, const fmi3ValueReference references[], size_t n,
                          const fmi3Float64 values[], size_t count)
{
    if (n != count) return fail(instance, "fmi3SetFloat64: expected a value for each reference");
    for (size_t i = 0; i < n; i++) {
        if (references[i] >= FMU_GIVEN) return fail(instance, "fmi3SetFloat64: expected an input or a parameter");
        ((FmuInstance *)instance)->memory.values[references[i]] = values[i];
    }
    return fmi3OK;
}

fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState *state)
{
    for (int i = 0; !*state && i < FMU_SAVED; i++)
        if (take(&saved_states[i].used)) *state = &saved_states[i];
    if (!*state) return fail(instance, "no room for another saved state, expected at most 64");
    ((FmuInstance *)*state)->memory = ((FmuInstance *)instance)->memory;
    return fmi3OK;
}

fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState state)
{
    ((FmuInstance *)instance)->memory = ((FmuInstance *)state)->memory;
    return fmi3OK;
}

fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState *state)
{
    (void)instance;
    if (*state) __atomic_store_n(&((FmuInstance *)*state)->used, 0, __ATOMIC_RELEASE);
    *state = NULL;
    return fmi3OK;
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, fmi3FMUState state, size_t *size)
{
    (void)instance, (void)state;
    *size = sizeof(FmuMemory);
    return fmi3OK;
}

fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState state, fmi3Byte bytes[], size_t size)
{
    if (size != sizeof(FmuMemory)) return fail(instance, "fmi3SerializeFMUState: another size");
    memcpy(bytes, &((FmuInstance *)state)->memory, size);
    return fmi3OK;
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const fmi3Byte bytes[], size_t size, fmi3FMUState *state)
{
    if (size != sizeof(FmuMemory)) return fail(instance, "fmi3DeserializeFMUState: another size");
    const fmi3Status found = fmi3GetFMUState(instance, state);
    if (found == fmi3OK) memcpy(&((FmuInstance *)*state)->memory, bytes, size);
    return found;
}

/* The following three functions do nothing and succeed; all remaining ones return an error or no instance. */
static fmi3Status done(void) { return fmi3OK; }
static fmi3Status not_supported(fmi3Instance instance) { return fail(instance, "function: not supported by this FMU"); }
static fmi3Instance no_instance(void) { return NULL; }

#pragma GCC diagnostic ignored "-Wattribute-alias"
#define ALIAS(name, of) extern name##TYPE name __attribute__((alias(#of)));
#define OTHER(name) ALIAS(fmi3##name, not_supported)
#define OF_TYPE(type) OTHER(Get##type) OTHER(Set##type)

/* clang-format off */
ALIAS(fmi3SetDebugLogging, done) ALIAS(fmi3EnterStepMode, done) ALIAS(fmi3Terminate, done)
OF_TYPE(Float32) OF_TYPE(Int8) OF_TYPE(UInt8) OF_TYPE(Int16) OF_TYPE(UInt16) OF_TYPE(Int32) OF_TYPE(UInt32)
OF_TYPE(Int64) OF_TYPE(UInt64) OF_TYPE(Boolean) OF_TYPE(String) OF_TYPE(Binary) OF_TYPE(Clock)
OF_TYPE(IntervalDecimal) OF_TYPE(IntervalFraction) OF_TYPE(ShiftDecimal) OF_TYPE(ShiftFraction)
OF_TYPE(ContinuousStates) OTHER(SetTime) OTHER(GetOutputDerivatives) OTHER(GetDirectionalDerivative)
OTHER(GetAdjointDerivative) OTHER(GetNumberOfVariableDependencies) OTHER(GetVariableDependencies)
OTHER(GetContinuousStateDerivatives) OTHER(GetEventIndicators) OTHER(GetNominalsOfContinuousStates)
OTHER(GetNumberOfEventIndicators) OTHER(GetNumberOfContinuousStates) OTHER(UpdateDiscreteStates)
OTHER(EvaluateDiscreteStates) OTHER(CompletedIntegratorStep) OTHER(ActivateModelPartition) OTHER(EnterEventMode)
OTHER(EnterConfigurationMode) OTHER(ExitConfigurationMode) OTHER(EnterContinuousTimeMode)
ALIAS(fmi3InstantiateModelExchange, no_instance) ALIAS(fmi3InstantiateScheduledExecution, no_instance)
    /* clang-format on */
