/* The exported controller on a Cortex-M7: start-up code, and a loop that reads the signals of a step and returns u.
 *
 * A request is k (int64) and the inputs of the block "controller", 29 doubles; the answer is struct Answer. They are
 * transferred by semihosting, with which a debugger or QEMU lets the program read and write files of the host, here its
 * standard input and output. The program ends at the end of the input.
 *
 * SysTick counts clock periods during a step. With "-icount shift=10" QEMU takes 1024 ns for every instruction, which
 * is 25.6 periods of the 25 MHz clock, so the count determines the number of instructions exactly. */
#include "hsv_block.h"

extern const hsv_block controller;
extern uint32_t stack_start[], stack_end[], bss_start[], bss_end[];

enum { INPUTS = 3 * HSV_STATES + HSV_INPUTS, ROOM = 64, UNUSED = 0x5aa55aa5 };
enum { SYS_OPEN = 0x01, SYS_WRITE = 0x05, SYS_READ = 0x06, SYS_EXIT = 0x18, APPLICATION_EXIT = 0x20026 };

struct Answer {
    double wanted[HSV_INPUTS];
    uint32_t ticks, stack; /* clock periods of this step; largest use of the stack since the start, bytes */
};

#define REGISTER(address) (*(volatile uint32_t *)(address))
#define SYSTICK_CONTROL REGISTER(0xe000e010)
#define SYSTICK_RELOAD REGISTER(0xe000e014)
#define SYSTICK_VALUE REGISTER(0xe000e018)
#define COPROCESSOR_ACCESS REGISTER(0xe000ed88)

static int semihosting(int operation, const void *arguments)
{
    register int r0 __asm__("r0") = operation;
    register const void *r1 __asm__("r1") = arguments;
    __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
}

static int open_file(const char *name, uint32_t length, uint32_t mode)
{
    const uint32_t arguments[] = {(uint32_t)name, mode, length};
    return semihosting(SYS_OPEN, arguments);
}

/* Read or write all bytes; return 1 if this was possible, else 0. A host call returns the number of bytes left. */
static int transfer(int operation, int file, void *bytes, uint32_t size)
{
    while (size > 0) {
        const uint32_t arguments[] = {(uint32_t)file, (uint32_t)bytes, size};
        const uint32_t left = (uint32_t)semihosting(operation, arguments);
        if (left >= size) return 0;
        bytes = (char *)bytes + (size - left), size = left;
    }
    return 1;
}

static uint32_t stack_used(void)
{
    const uint32_t *word = stack_start;
    while (word < stack_end && *word == UNUSED) word++;
    return (uint32_t)((const char *)stack_end - (const char *)word);
}

static void serve(void)
{
    static struct {
        int64_t k;
        double in[INPUTS];
    } request;
    static struct Answer answer;
    static double out[ROOM], state[ROOM], parameters[ROOM];
    const int input = open_file("/dev/stdin", 10, 1), output = open_file("/dev/stdout", 11, 5); /* "rb", "wb" */
    int count = 0;
    for (int i = 0; i < controller.parameter_count; i++)
        for (int j = 0; j < controller.parameters[i].size; j++) parameters[count++] = controller.parameters[i].value[j];
    while (transfer(SYS_READ, input, &request, sizeof request)) {
        if (request.k == 0)
            for (int i = 0; i < ROOM; i++) state[i] = 0.0;
        const uint32_t before = SYSTICK_VALUE;
        controller.step(request.k, request.in, out, state, parameters);
        answer.ticks = (before - SYSTICK_VALUE) & 0xffffff; /* SysTick counts down */
        answer.stack = stack_used();
        for (int i = 0; i < HSV_INPUTS; i++) answer.wanted[i] = out[i];
        if (!transfer(SYS_WRITE, output, &answer, sizeof answer)) break;
    }
}

void reset(void)
{
    COPROCESSOR_ACCESS |= 0xfu << 20; /* enable the floating-point unit */
    __asm__ volatile("dsb\n isb");
    for (uint32_t *word = bss_start; word < bss_end; word++) *word = 0;
    uint32_t *here;
    __asm__ volatile("mov %0, sp" : "=r"(here));
    for (uint32_t *word = stack_start; word < here; word++) *word = UNUSED;
    SYSTICK_RELOAD = 0xffffff, SYSTICK_VALUE = 0, SYSTICK_CONTROL = 5; /* enabled, with the processor clock */
    serve();
    semihosting(SYS_EXIT, (const void *)APPLICATION_EXIT);
    for (;;) {
    }
}

static void fault(void)
{
    semihosting(SYS_EXIT, (const void *)0x20023); /* ADP_Stopped_RunTimeErrorUnknown */
    for (;;) {
    }
}

__attribute__((section(".vectors"), used)) static void *const vectors[16] = {
    stack_end, reset, fault, fault, fault, fault, fault,
};
