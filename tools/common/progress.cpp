#include "progress.h"

#include <unistd.h>

#include <cstdio>
#include <utility>

namespace rtc::tools {

Progress::Progress(std::string label, uint64_t steps, bool quiet)
    : label_(std::move(label)),
      steps_(steps ? steps : 1),
      quiet_(quiet),
      start_(std::chrono::steady_clock::now()),
      last_(start_) {}

double Progress::seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
}

void Progress::update(uint64_t done, double rays) {
    if (quiet_ || !isatty(STDOUT_FILENO)) return;
    const auto now = std::chrono::steady_clock::now();
    if (done < steps_ && now - last_ < std::chrono::milliseconds(100)) return;
    last_ = now;
    constexpr int kWidth = 30;
    const int filled = int(done * kWidth / steps_);
    char bar[kWidth + 1] = {};
    for (int i = 0; i < kWidth; ++i) bar[i] = i < filled ? '#' : '.';
    std::printf("\r%s [%s] %3d %%  %.2f Mrays/s ", label_.c_str(), bar, int(done * 100 / steps_),
                rays / seconds() * 1e-6);
    std::fflush(stdout);
}

void Progress::finish(double rays) {
    if (quiet_) return;
    if (isatty(STDOUT_FILENO)) std::printf("\r\033[K");
    std::printf("%s: %.2f s, %.1f million rays, %.2f Mrays/s\n", label_.c_str(), seconds(), rays * 1e-6,
                rays / seconds() * 1e-6);
    std::fflush(stdout);
}

}  // namespace rtc::tools
