// rockfall_solver.hpp: a solver for rockfall as a C++ class. Derive from rockfall::Solver, and return serve() from main:
// templates/cpp/net.cpp is an example. The arrays are those of rockfall_solver.h, where shapes and units stand.
//
// What a function throws ends the run with its text: nothing is thrown through the library.
#ifndef ROCKFALL_SOLVER_HPP
#define ROCKFALL_SOLVER_HPP

#include "rockfall_solver.h"

#include <cstddef>
#include <cstdint>
#include <exception>
#include <stdexcept>
#include <string>
#include <vector>

namespace rockfall {

// Why a solver does not do what was asked. Other exceptions count as Broken.
class Fault : public std::runtime_error {
public:
    Fault(int kind, const std::string &what) : std::runtime_error(what), kind(kind) {}
    const int kind; // RF_INPUT, RF_WINDOW, RF_BROKEN
};

inline Fault input(const std::string &what) { return Fault(RF_INPUT, what); }   // the user's input is wrong
inline Fault window(const std::string &what) { return Fault(RF_WINDOW, what); } // a shorter window may succeed

// What prepare() returns; a contact solver leaves `coordinates` empty to work on the partner's mesh.
struct Ready {
    std::vector<double> coordinates;       // [nodes][3], at t = 0 [m]
    std::vector<std::uint32_t> line_nodes; // [lines][2]
    std::vector<double> line_radius;       // [lines] [m], or empty
    std::vector<std::uint32_t> face_nodes; // [faces][3]
    std::vector<double> masses;            // [nodes] [kg], infinite where held, or empty
    std::vector<rf_gauge> gauges;
};

class Solver {
public:
    std::string program = "a solver in C++"; // name and version, for messages
    double repeats = 0.0;                    // 0: it repeats a window to equal bytes; below 0: it cannot
    double largest_window = 0.0;             // [s]; 0: no limit
    std::vector<rf_field> takes, gives;      // what it can take and give

    virtual ~Solver() = default;
    virtual Ready prepare(const rf_plan &plan) = 0;
    virtual void start(double *const * /*gives*/, double * /*gauges*/) {}
    virtual void solve(const rf_window &window, const double *const *takes, double *const *gives, double *gauges) = 0;
    virtual void commit() = 0;
    virtual void finish() {}
    virtual bool at_rest() { return false; }

    // Take part in the run of this program's command line; returns its exit code.
    int serve() {
        rf_solver solver = {};
        solver.program = program.c_str();
        solver.data = this;
        solver.repeats = repeats;
        solver.largest_window = largest_window;
        solver.takes = takes.data();
        solver.take_count = takes.size();
        solver.gives = gives.data();
        solver.give_count = gives.size();
        solver.prepare = [](void *self, const rf_plan *plan, rf_ready *ready) {
            return of(self, [&](Solver &s) { s.fill(*plan, *ready); });
        };
        solver.start = [](void *self, double *const *gives, double *gauges) {
            return of(self, [&](Solver &s) { s.start(gives, gauges); });
        };
        solver.solve = [](void *self, const rf_window *window, const double *const *takes, double *const *gives,
                          double *gauges) {
            return of(self, [&](Solver &s) { s.solve(*window, takes, gives, gauges); });
        };
        solver.commit = [](void *self) { return of(self, [](Solver &s) { s.commit(); }); };
        solver.finish = [](void *self) { return of(self, [](Solver &s) { s.finish(); }); };
        solver.at_rest = [](void *self) {
            bool rests = false;
            return of(self, [&](Solver &s) { rests = s.at_rest(); }) == RF_OK && rests ? 1 : 0;
        };
        return rf_serve(&solver);
    }

private:
    Ready ready_;

    void fill(const rf_plan &plan, rf_ready &ready) {
        ready_ = prepare(plan);
        if (!ready_.coordinates.empty()) {
            check("line_radius", ready_.line_radius.size(), ready_.line_nodes.size() / 2);
            check("masses", ready_.masses.size(), ready_.coordinates.size() / 3);
            ready.mesh.nodes = ready_.coordinates.size() / 3;
            ready.mesh.coordinates = ready_.coordinates.data();
            ready.mesh.lines = ready_.line_nodes.size() / 2;
            ready.mesh.line_nodes = ready_.line_nodes.data();
            ready.mesh.line_radius = ready_.line_radius.empty() ? nullptr : ready_.line_radius.data();
            ready.mesh.faces = ready_.face_nodes.size() / 3;
            ready.mesh.face_nodes = ready_.face_nodes.data();
            ready.mesh.masses = ready_.masses.empty() ? nullptr : ready_.masses.data();
        }
        ready.gauges = ready_.gauges.data();
        ready.gauge_count = ready_.gauges.size();
    }

    static void check(const char *what, std::size_t has, std::size_t needs) {
        if (has != 0 && has != needs)
            throw Fault(RF_BROKEN, std::string(what) + " has " + std::to_string(has) + " numbers, not " +
                                       std::to_string(needs));
    }

    template <typename Work> static int of(void *self, Work work) {
        try {
            work(*static_cast<Solver *>(self));
            return RF_OK;
        } catch (const Fault &fault) {
            rf_explain(fault.what());
            return fault.kind;
        } catch (const std::exception &error) {
            rf_explain(error.what());
        } catch (...) {
            rf_explain("an exception without a text");
        }
        return RF_BROKEN;
    }
};

} // namespace rockfall

#endif // ROCKFALL_SOLVER_HPP
