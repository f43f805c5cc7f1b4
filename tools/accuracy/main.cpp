// rtc-accuracy: what a tier leaks, how exact it is, what it costs.
#include <fstream>

#include "commands.h"
#include "error.h"
#include "report.h"

double rtc::lab::upper_bound(uint64_t events, uint64_t n) { return Rate{events, n}.bound(); }

void rtc::lab::write_file(const std::string& path, const std::string& text) {
    std::ofstream file(path, std::ios::binary);
    file << text;
    if (!file.flush()) throw rtc::tools::Error("cannot write " + path);
}

int main(int argc, char** argv) {
    return rtc::tools::run_program("rtc-accuracy", [&] {
        const std::string command = argc > 1 ? argv[1] : "";
        if (command == "leaks") return rtc::lab::leaks_command(argc - 1, argv + 1);
        if (command == "spawn") return rtc::lab::spawn_command(argc - 1, argv + 1);
        if (command == "agree") return rtc::lab::agree_command(argc - 1, argv + 1);
        if (command == "report") return rtc::lab::report_command(argc - 1, argv + 1);
        if (command == "check") return rtc::lab::check_command(argc - 1, argv + 1);
        return rtc::lab::measure_command(argc, argv);
    });
}
