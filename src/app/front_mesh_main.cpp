#include <fmt/format.h>

#include <cstdio>
#include <exception>
#include <filesystem>
#include <string>
#include <vector>

#include "evaluate/evaluate.hpp"
#include "evaluate/front_mesh.hpp"
#include "knap/error.hpp"

// Measures by a mesh what `knap evaluate` measures without one. A program of its own, because it is
// under the GPL, as CGAL is.
//
//   knap-front-mesh SIMPLIFIED THREADS ORIGINAL...

int main(int argc, char** argv) {
    try {
        const std::vector<std::string> arguments(argv + 1, argv + argc);
        if (arguments.size() < 3) {
            throw knap::ConfigError("expected SIMPLIFIED THREADS ORIGINAL...");
        }
        const knap::FrontMesh mesh(knap::simplified_points(arguments[0]));
        const std::vector<std::filesystem::path> originals(arguments.begin() + 2, arguments.end());
        const knap::Evaluation found =
            knap::evaluate(originals, mesh, std::stoi(arguments[1]), [](std::uint64_t) {});
        fmt::print("{}\n", knap::describe("mesh", found));
        return 0;
    } catch (const std::bad_alloc&) {
        fmt::print(stderr, "knap-front-mesh: error: out of memory\n");
        return 2;
    } catch (const std::exception& error) {
        fmt::print(stderr, "knap-front-mesh: error: {}\n", error.what());
        return 1;
    }
}
