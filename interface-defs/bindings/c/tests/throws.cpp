// A solver that throws in the second window, for the test of the bindings: the run must end with its text.
#include <limits>
#include <rockfall_solver.hpp>

class Thrower : public rockfall::Solver {
public:
    explicit Thrower(bool plain) : plain(plain) {
        takes = {{"force", 3, RF_NODE, RF_MEANS, 1}};
        gives = {{"displacement", 3, RF_NODE, RF_AT_ENDS, 1}, {"velocity", 3, RF_NODE, RF_AT_ENDS, 1}};
    }
    rockfall::Ready prepare(const rf_plan &) override {
        rockfall::Ready ready;
        ready.coordinates = {0.0, 0.0, 0.0};
        // It does not move, whatever the force.
        ready.masses = {std::numeric_limits<double>::infinity()};
        return ready;
    }
    void solve(const rf_window &window, const double *const *, double *const *gives, double *) override {
        for (int i = 0; i < 3; i++) gives[0][i] = gives[1][i] = 0.0;
        if (window.number < 2) return;
        if (plain) throw 7;
        throw std::runtime_error("the net caught fire");
    }
    void commit() override {}

private:
    bool plain;
};

int main(int, char **argv) { return Thrower(std::string(argv[1]) == "plain").serve(); }
