// Command lines that fail as everything else in these programs does: "PROGRAM: error: text", exit status 1.
#pragma once

#include <CLI/CLI.hpp>

#include <cstdio>
#include <cstdlib>
#include <sstream>
#include <string>

namespace rtc::tools {

// CLI::Range lets NaN pass.
inline CLI::Validator number_between(double low, double high) {
    return CLI::Validator(
        [low, high](std::string& text) {
            char* end = nullptr;
            const double value = std::strtod(text.c_str(), &end);
            if (*end == 0 && value >= low && value <= high) return std::string();
            std::ostringstream problem;
            problem << "'" << text << "' is no number from " << low << " to " << high;
            return problem.str();
        },
        "NUMBER");
}

// -1: go on. Else the program's exit status: 0 after --help.
inline int parse_command_line(CLI::App& app, const char* program, int argc, char** argv) {
    try {
        app.parse(argc, argv);
        return -1;
    } catch (const CLI::ParseError& problem) {
        if (problem.get_exit_code() == int(CLI::ExitCodes::Success)) return app.exit(problem);
        std::fprintf(stderr, "%s: error: %s (--help lists the options)\n", program, problem.what());
        return 1;
    }
}

}  // namespace rtc::tools
