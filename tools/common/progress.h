// A progress bar on a terminal; a line at the end elsewhere.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

namespace rtc::tools {

class Progress {
  public:
    Progress(std::string label, uint64_t steps, bool quiet = false);
    // `rays` traced so far, for the rate.
    void update(uint64_t done, double rays);
    void finish(double rays);
    double seconds() const;

  private:
    std::string label_;
    uint64_t steps_;
    bool quiet_;
    std::chrono::steady_clock::time_point start_, last_;
};

}  // namespace rtc::tools
