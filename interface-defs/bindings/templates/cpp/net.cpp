// A net of masses and springs as the structure of a run.
//
// 7 x 7 nodes, the edge held; position Verlet, steps of 0.1 ms at most; it repeats a window to equal bytes.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <rockfall_solver.hpp>

constexpr int SIDE = 7, NODES = SIDE * SIDE, CENTRE = NODES / 2;
constexpr double SPACING = 0.5;   // [m]
constexpr double REST = 0.49;     // length of a spring without force [m]
constexpr double MASS = 1.0;      // of a node [kg]
constexpr double STIFFNESS = 5e4; // of a spring [N/m]
constexpr double STEP = 1e-4;     // the longest [s]
constexpr double HELD = std::numeric_limits<double>::infinity();

using Nodes = std::array<double, 3 * NODES>;

struct State {
    Nodes u{}, v{}; // displacement from t = 0 [m], velocity [m/s]
};

class Net : public rockfall::Solver {
public:
    Net() {
        program = "net (C++)";
        largest_window = 1e-3;
        takes = {{"force", 3, RF_NODE, RF_MEANS, 1}};
        gives = {{"displacement", 3, RF_NODE, RF_AT_ENDS, 1}, {"velocity", 3, RF_NODE, RF_AT_ENDS, 1}};
    }

    rockfall::Ready prepare(const rf_plan &) override {
        for (std::uint32_t n = 0; n < NODES; n++) {
            int i = n % SIDE, j = n / SIDE;
            x[3 * n] = SPACING * (i - 3);
            x[3 * n + 1] = SPACING * (j - 3);
            mass[n] = i == 0 || j == 0 || i == SIDE - 1 || j == SIDE - 1 ? HELD : MASS;
            if (i + 1 < SIDE) springs.insert(springs.end(), {n, n + 1});
            if (j + 1 < SIDE) springs.insert(springs.end(), {n, n + SIDE});
        }
        rockfall::Ready ready;
        ready.coordinates.assign(x.begin(), x.end());
        ready.line_nodes = springs;
        ready.line_radius.assign(springs.size() / 2, 0.01);
        ready.masses.assign(mass.begin(), mass.end());
        ready.gauges = {{"centre_uz", "m", RF_NO_ROLE, 1}, {"reaction_z", "N", RF_NO_ROLE, 1}};
        return ready;
    }

    void solve(const rf_window &window, const double *const *takes, double *const *gives, double *gauges) override {
        trial = committed;
        auto &[u, v] = trial;
        const double *load = takes[0];
        const int steps = std::max(1, int(std::ceil(window.length / STEP * (1.0 - 1e-9))));
        const double h = window.length / steps;
        std::fill_n(gauges, 6, 0.0);
        gauges[1] = gauges[4] = HELD;
        gauges[2] = gauges[5] = -HELD;
        for (int step = 0; step < steps; step++) {
            for (int i = 0; i < 3 * NODES; i++) u[i] += 0.5 * h * v[i];
            Nodes f{};
            add_forces(u, f);
            double support = 0.0;
            for (int n = 0; n < NODES; n++) {
                if (mass[n] == HELD) {
                    support -= f[3 * n + 2] + load[3 * n + 2];
                    continue;
                }
                for (int i = 3 * n; i < 3 * n + 3; i++) {
                    v[i] += h * (f[i] + load[i]) / MASS;
                    u[i] += 0.5 * h * v[i];
                }
            }
            record(gauges, u[3 * CENTRE + 2], u[3 * CENTRE + 2]);
            record(gauges + 3, support, gauges[3] + support / steps);
        }
        std::copy(u.begin(), u.end(), gives[0]);
        std::copy(v.begin(), v.end(), gives[1]);
    }

    void commit() override { committed = trial; }

private:
    Nodes x{}; // position at t = 0 [m]
    std::array<double, NODES> mass{};
    std::vector<std::uint32_t> springs;
    State committed, trial;

    // Add the forces of all springs [N].
    void add_forces(const Nodes &u, Nodes &f) const {
        for (std::size_t s = 0; s < springs.size(); s += 2) {
            const int a = 3 * springs[s], b = 3 * springs[s + 1];
            double d[3];
            for (int k = 0; k < 3; k++) d[k] = (x[b + k] + u[b + k]) - (x[a + k] + u[a + k]);
            const double length = std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
            const double pull = STIFFNESS * (length - REST) / length;
            for (int k = 0; k < 3; k++) {
                f[a + k] += pull * d[k];
                f[b + k] -= pull * d[k];
            }
        }
    }

    static void record(double *gauge, double value, double sum) {
        gauge[0] = sum;
        gauge[1] = std::min(gauge[1], value);
        gauge[2] = std::max(gauge[2], value);
    }
};

int main() { return Net().serve(); }
