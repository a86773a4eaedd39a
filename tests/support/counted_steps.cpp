// A program: step exported blocks through all their branches, with numbers that count what is computed with them, and
// print the most that a step of each block took: name, multiplications and divisions, additions, comparisons.

#include <cfloat>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <initializer_list>

struct Count {
    long multiplications, additions, comparisons;
};
static Count count;

struct Counted {
    double value;
    Counted() = default;
    constexpr Counted(double number) : value(number) {}
    explicit operator int() const { return (int)value; }
    Counted &operator+=(Counted other)
    {
        count.additions++;
        value += other.value;
        return *this;
    }
    friend Counted operator+(Counted a, Counted b) { return a += b; }
    friend Counted operator-(Counted a, Counted b) { return count.additions++, a.value - b.value; }
    friend Counted operator*(Counted a, Counted b) { return count.multiplications++, a.value * b.value; }
    friend Counted operator/(Counted a, Counted b) { return count.multiplications++, a.value / b.value; }
    friend bool operator<(Counted a, Counted b) { return count.comparisons++, a.value < b.value; }
    friend bool operator>(Counted a, Counted b) { return count.comparisons++, a.value > b.value; }
    friend bool operator<=(Counted a, Counted b) { return count.comparisons++, a.value <= b.value; }
    friend bool operator>=(Counted a, Counted b) { return count.comparisons++, a.value >= b.value; }
    friend bool operator==(Counted a, Counted b) { return count.comparisons++, a.value == b.value; }
    friend bool operator!=(Counted a, Counted b) { return count.comparisons++, a.value != b.value; }
};

// Of the headers; no exported block calls them.
Counted fabs(Counted);
Counted sqrt(Counted);

#define double Counted
#define new new_ // a variable in C
#include "controller.c"
#undef double
#undef new

static void most_of(const hsv_block &block, const Counted *in, Counted *state, Count &most)
{
    static Counted out[100], par[100];
    for (int64_t k : {0, 1})
        for (double rate : {0.0, 0.1}) {
            for (int i = 0; i < RIGID; i++) par[i] = 1.0;
            par[RIGID] = rate;
            count = {};
            block.step(k, in, out, state, par);
            most.multiplications = std::fmax(most.multiplications, count.multiplications);
            most.additions = std::fmax(most.additions, count.additions);
            most.comparisons = std::fmax(most.comparisons, count.comparisons);
        }
}

int main()
{
    const double far = 1e6, ends[] = {-far, 0.0, far, NAN};
    for (const hsv_block *block : {&notch_filter, &nominal_trajectory, &tube_law}) {
        Count most = {};
        for (double value : ends) {
            Counted in[100], state[100];
            for (int i = 0; i < 100; i++) in[i] = value, state[i] = value;
            most_of(*block, in, state, most);
            const hsv_axis &h = nominal_data.polytope.altitude, &v = nominal_data.polytope.velocity;
            in[HSV_ALTITUDE] = h.breakpoints[h.pieces];
            in[HSV_VELOCITY] = v.breakpoints[v.pieces];
            most_of(*block, in, state, most);
        }
        // Of the nominal trajectory: x_n in the outermost ellipsoid, along one of its axes in no other.
        for (int axis = 0; axis < RIGID; axis++) {
            Counted in[100], state[100];
            for (int i = 0; i < 100; i++) in[i] = state[i] = 0.0;
            in[axis] = 0.999 / std::sqrt(nominal_data.ellipsoids[(RIGID + 1) * axis].value);
            most_of(*block, in, state, most);
        }
        std::printf("%s %ld %ld %ld\n", block->name, most.multiplications, most.additions, most.comparisons);
    }
}
