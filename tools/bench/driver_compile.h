// The Vulkan driver's compile time of a linked module: process time of pipeline creation and the first launch
// (lavapipe compiles at the first launch), less that of a second launch.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace rtc::bench {

class DriverCompiler {
  public:
    explicit DriverCompiler(const std::string& device);
    ~DriverCompiler();
    std::string name() const;
    double cpu_seconds(const std::vector<uint32_t>& module);

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace rtc::bench
