#include "demo.h"

#include <chrono>
#include <cstdio>
#include <filesystem>

#include "image_file.h"

namespace rtc::tools {

void draw_demo(const RtcDevice& device, const std::string& folder, const RenderOptions& base) {
    struct Shot {
        const char *title, *scene, *file;
        Integrator integrator;
        uint32_t samples, max_bounces;
    };
    // Sample counts are the least that look clean: two CPU cores are to draw all three in minutes.
    const Shot shots[] = {
        {"Cornell box, path traced", "builtin:cornell", "cornell-path.png", Integrator::Path, 32, 6},
        {"sphere flake, recursive reflections", "builtin:spheres", "spheres-reflections.png",
         Integrator::Reflections, 6, 0},
        {"scanned bunny, 69 666 triangles, path traced", "builtin:bunny", "bunny-path.png", Integrator::Path, 16,
         4},
    };
    std::filesystem::create_directories(folder);
    const auto start = std::chrono::steady_clock::now();
    for (const Shot& shot : shots) {
        std::printf("\n%s\n", shot.title);
        RenderOptions options = base;
        options.settings.integrator = shot.integrator;
        options.samples = shot.samples;
        if (shot.max_bounces) options.settings.max_bounces = shot.max_bounces;
        const RenderResult result = render(device, load_scene(shot.scene), options);
        const std::string path = folder + "/" + shot.file;
        write_picture(path, result.picture);
        std::printf("wrote %s (compile %.2f s, build %.2f s, trace %.2f s)\n", path.c_str(),
                    result.compile_seconds, result.build_seconds, result.trace_seconds);
    }
    std::printf("\nthree pictures in %s, %.0f s\n", folder.c_str(),
                std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
}

}  // namespace rtc::tools
