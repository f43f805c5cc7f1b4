// rtc-info: does rtc run here, in which mode, what is missing, how should modules be specialised.
#include <cstdio>

#include "command_line.h"
#include "error.h"
#include "report.h"

int main(int argc, char** argv) {
    using namespace rtc::tools;
    std::string wanted;
    bool json = false, no_probe = false;
    CLI::App app{"Says for each Vulkan device whether rtc runs on it, and how."};
    app.add_option("--device", wanted, "only this one: index or part of the name");
    app.add_flag("--json", json, "as JSON");
    app.add_flag("--no-probe", no_probe, "do not run the float probe on the devices");
    if (const int status = rtc::tools::parse_command_line(app, "rtc-info", argc, argv); status >= 0) return status;
    return run_program("rtc-info", [&] {
        const DeviceList list;
        std::vector<DeviceReport> reports;
        for (const DeviceInfo& device : list.devices)
            if (wanted.empty() || &select_device(list.devices, wanted) == &device)
                reports.push_back(examine(list, device, !no_probe));
        if (reports.empty()) throw Error("no Vulkan device found");
        if (json) {
            std::printf("%s", as_json(reports).c_str());
        } else {
            for (const DeviceReport& report : reports) std::printf("%s", as_text(report).c_str());
        }
        bool any = false;
        for (const DeviceReport& report : reports) any = any || report.support.supported;
        return any ? 0 : 2;  // 2: no device rtc runs on
    });
}
