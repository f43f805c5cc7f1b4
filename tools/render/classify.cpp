#include "classify.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <mutex>
#include <thread>

#include "error.h"

namespace rtc::tools {
namespace {

constexpr uint32_t kClosest = 1, kShadow = 2;
constexpr size_t kExamples = 8;

JudgedRay ray_of(const LoggedRay& record) {
    return {{record.origin[0], record.origin[1], record.origin[2]},
            {record.direction[0], record.direction[1], record.direction[2]},
            record.end};
}

bool same_ray(const LoggedRay& a, const LoggedRay& b) {
    return std::memcmp(&a, &b, offsetof(LoggedRay, hit)) == 0;
}

// A miss has no primitive.
bool same_find(const LoggedRay& a, const LoggedRay& b) {
    return a.kind == b.kind && a.hit[0] == b.hit[0] &&
           (a.kind != kClosest || a.hit[0] == kNothing || a.hit[1] == b.hit[1]);
}

glm::vec2 barycentrics(const LoggedRay& record) {
    glm::vec2 result;
    std::memcpy(&result, &record.hit[2], sizeof result);
    return result;
}

Ruling rule(const Judge& judge, const LoggedRay& record) {
    if (record.kind == kShadow) return judge.shadow(ray_of(record), record.hit[0] != 0);
    return judge.closest(ray_of(record), {record.hit[0], record.hit[1]});
}

void measure(const LoggedRay& a, const LoggedRay& b, double scene_size, double& origin, double& angle) {
    const JudgedRay p = ray_of(a), q = ray_of(b);
    origin = std::max(origin, glm::length(glm::dvec3(p.origin) - glm::dvec3(q.origin)) / scene_size);
    const glm::dvec3 d = p.direction, e = q.direction;
    angle = std::max(angle, std::atan2(glm::length(glm::cross(d, e)), glm::dot(d, e)));
}

std::string found_text(const LoggedRay& record) {
    if (record.kind == kShadow) return record.hit[0] ? "nothing in the way" : "something in the way";
    if (record.hit[0] == kNothing) return "nothing";
    return "instance " + std::to_string(record.hit[0]) + " primitive " + std::to_string(record.hit[1]);
}

std::string example(const char* who, const LoggedRay& record, const Judge& judge) {
    char text[256];
    std::snprintf(text, sizeof text, "%s: ray from (%a, %a, %a) along (%a, %a, %a) up to %a found ", who,
                  double(record.origin[0]), double(record.origin[1]), double(record.origin[2]),
                  double(record.direction[0]), double(record.direction[1]), double(record.direction[2]),
                  double(record.end));
    const Answer exact = judge.nearest(ray_of(record));
    return text + found_text(record) + "; exact arithmetic: " +
           (exact.instance == kNothing ? std::string("nothing")
                                       : "instance " + std::to_string(exact.instance) + " primitive " +
                                             std::to_string(exact.primitive));
}

uint8_t judge_parting(const Judge& judge, double scene_size, const LoggedRay& native, const LoggedRay& ours,
                   Classification& result) {
    const Ruling theirs = rule(judge, native), own = rule(judge, ours);
    if (theirs == Ruling::Wrong && result.examples.size() < kExamples)
        result.examples.push_back(example("native", native, judge));
    if (own == Ruling::Wrong && result.examples.size() < kExamples)
        result.examples.push_back(example("rtc", ours, judge));
    if (theirs == Ruling::Wrong || own == Ruling::Wrong) {
        ++(theirs != own ? (own == Ruling::Wrong ? result.ours_wrong : result.native_wrong)
                         : result.both_wrong);
        return kPartedWrong;
    }
    if (!same_ray(native, ours)) {
        ++result.other_rays;
        measure(native, ours, scene_size, result.parted_origin, result.parted_angle);
        return kPartedOtherRays;
    }
    if (theirs == Ruling::Rounding || own == Ruling::Rounding) {
        ++result.rounding;
        result.exact_is_native += own == Ruling::Rounding && theirs != Ruling::Rounding;
        result.exact_is_ours += theirs == Ruling::Rounding && own != Ruling::Rounding;
        return kPartedRounding;
    }
    ++result.ties;
    return kPartedTie;
}

// Parting bits of the first difference, 0 if there is none.
uint8_t classify_sample(const Judge& judge, double scene_size, const LoggedRay* native, const LoggedRay* ours,
                        uint32_t places, Classification& result) {
    ++result.samples;
    // after_hit: the first bits that differ are barycentrics of the same triangle, found by equal rays.
    bool rays_parted = false, after_hit = false;
    for (uint32_t i = 0; i < places; ++i) {
        const LoggedRay &a = native[i], &b = ours[i];
        if (i == 0) {
            ++result.primary_rays;
            result.primary_hits_differ += !same_find(a, b);
        }
        if (a.kind != b.kind) {
            ++result.decisions;
        } else {
            if (a.kind == 0) continue;
            ++result.rays;
            const bool equal = same_ray(a, b), found = same_find(a, b);
            result.same_rays += equal;
            result.same_hits += equal && found;
            if (!equal && !rays_parted) {
                rays_parted = true;
                measure(a, b, scene_size, result.first_origin, result.first_angle);
            }
            if (found) {
                if (equal && a.kind == kClosest && a.hit[0] != kNothing &&
                    std::memcmp(a.hit, b.hit, sizeof a.hit)) {
                    after_hit = after_hit || !rays_parted;
                    result.barycentrics_apart =
                        std::max(result.barycentrics_apart,
                                 judge.apart(ray_of(a), {a.hit[0], a.hit[1]}, barycentrics(a), barycentrics(b)));
                }
                continue;
            }
            const uint8_t parting = judge_parting(judge, scene_size, a, b, result);
            if (parting != kPartedOtherRays) return parting;
        }
        ++(after_hit ? result.began_in_barycentrics : result.began_in_shading);
        return kPartedOtherRays;
    }
    return 0;
}

}  // namespace

void Classification::add(const Classification& other) {
    for (auto member :
         {&Classification::samples, &Classification::rays, &Classification::same_rays, &Classification::same_hits,
          &Classification::ties, &Classification::rounding, &Classification::native_wrong,
          &Classification::ours_wrong, &Classification::both_wrong, &Classification::other_rays,
          &Classification::decisions, &Classification::exact_is_native, &Classification::exact_is_ours,
          &Classification::began_in_shading, &Classification::began_in_barycentrics,
          &Classification::primary_rays, &Classification::primary_hits_differ})
        this->*member += other.*member;
    for (auto member : {&Classification::first_origin, &Classification::first_angle,
                        &Classification::parted_origin, &Classification::parted_angle,
                        &Classification::barycentrics_apart})
        this->*member = std::max(this->*member, other.*member);
    for (const std::string& text : other.examples)
        if (examples.size() < kExamples) examples.push_back(text);
}

Classification classify(const Judge& judge, double scene_size, const std::vector<LoggedRay>& native,
                        const std::vector<LoggedRay>& ours, uint32_t places, std::vector<uint8_t>& partings) {
    if (native.size() != ours.size() || places == 0 || native.size() != places * partings.size())
        throw Error("records of different size cannot be compared");
    const size_t pixels = partings.size();
    const size_t count = std::clamp<size_t>(std::thread::hardware_concurrency(), 1, 64);
    Classification total;
    std::mutex lock;
    std::vector<std::thread> threads;
    for (size_t worker = 0; worker < count; ++worker)
        threads.emplace_back([&, worker] {
            Classification mine;
            for (size_t pixel = pixels * worker / count; pixel < pixels * (worker + 1) / count; ++pixel)
                partings[pixel] |= classify_sample(judge, scene_size, &native[pixel * places],
                                                   &ours[pixel * places], places, mine);
            const std::lock_guard<std::mutex> held(lock);
            total.add(mine);
        });
    for (std::thread& thread : threads) thread.join();
    return total;
}

std::string as_text(const Classification& c) {
    char text[2048];
    auto number = [](uint64_t value) { return static_cast<unsigned long long>(value); };
    std::snprintf(
        text, sizeof text,
        "classify: %llu samples, %llu rays on both sides; %llu equal bit for bit, of which %llu found the same\n"
        "classify: primary hits differ at %llu of %llu\n"
        "classify: %llu samples part: %llu ties, %llu within rounding (exact is native's %llu, rtc's %llu), "
        "%llu native wrong, %llu rtc wrong, %llu both wrong; rays already differed %llu, one side traced no "
        "ray %llu\n"
        "classify: of the last two kinds, %llu began in the shaders' arithmetic, %llu in barycentrics\n"
        "classify: rays apart at their first difference at most %.1e of the scene and %.1e rad, where they part "
        "%.1e and %.1e rad; barycentrics of equal rays at most %.2f bounds apart\n",
        number(c.samples), number(c.rays), number(c.same_rays), number(c.same_hits),
        number(c.primary_hits_differ), number(c.primary_rays), number(c.parted()), number(c.ties),
        number(c.rounding), number(c.exact_is_native), number(c.exact_is_ours), number(c.native_wrong),
        number(c.ours_wrong), number(c.both_wrong), number(c.other_rays), number(c.decisions),
        number(c.began_in_shading), number(c.began_in_barycentrics), c.first_origin, c.first_angle,
        c.parted_origin, c.parted_angle, c.barycentrics_apart);
    std::string result = text;
    for (const std::string& line : c.examples) result += "classify: " + line + "\n";
    return result;
}

namespace {

class JsonObject {
  public:
    void number(const char* name, double value) {
        char text[96];
        std::snprintf(text, sizeof text, "%s\"%s\": %.9g", text_.empty() ? "" : ", ", name, value);
        text_ += text;
    }
    std::string text() const { return "{" + text_ + "}"; }

  private:
    std::string text_;
};

}  // namespace

std::string as_json(const Classification& c) {
    JsonObject object;
    const std::pair<const char*, uint64_t> counts[] = {{"samples", c.samples},
                                                       {"rays", c.rays},
                                                       {"same_rays", c.same_rays},
                                                       {"same_hits", c.same_hits},
                                                       {"parted", c.parted()},
                                                       {"ties", c.ties},
                                                       {"rounding", c.rounding},
                                                       {"exact_is_native", c.exact_is_native},
                                                       {"exact_is_ours", c.exact_is_ours},
                                                       {"native_wrong", c.native_wrong},
                                                       {"ours_wrong", c.ours_wrong},
                                                       {"both_wrong", c.both_wrong},
                                                       {"other_rays", c.other_rays},
                                                       {"decisions", c.decisions},
                                                       {"began_in_shading", c.began_in_shading},
                                                       {"began_in_barycentrics", c.began_in_barycentrics},
                                                       {"primary_rays", c.primary_rays},
                                                       {"primary_hits_differ", c.primary_hits_differ}};
    for (const auto& [name, value] : counts) object.number(name, double(value));
    object.number("first_origin", c.first_origin);
    object.number("first_angle", c.first_angle);
    object.number("parted_origin", c.parted_origin);
    object.number("parted_angle", c.parted_angle);
    object.number("barycentrics_apart", c.barycentrics_apart);
    return object.text();
}

DifferingPixels sort_pixels(const std::vector<double>& differences, double tolerance,
                            const std::vector<uint8_t>& partings) {
    if (differences.size() != partings.size()) throw Error("pictures of different size cannot be compared");
    DifferingPixels result;
    for (size_t i = 0; i < partings.size(); ++i) {
        if (differences[i] <= tolerance) continue;
        if (partings[i] & kPartedWrong)
            ++result.wrong;
        else if (partings[i] & kPartedTie)
            ++result.ties;
        else if (partings[i] & kPartedRounding)
            ++result.rounding;
        else if (partings[i] & kPartedOtherRays)
            ++result.other_rays;
        else {
            ++result.shading;
            result.largest_shading = std::max(result.largest_shading, differences[i]);
        }
    }
    return result;
}

std::string as_text(const DifferingPixels& pixels) {
    auto number = [](uint64_t value) { return static_cast<unsigned long long>(value); };
    char text[512];
    std::snprintf(text, sizeof text,
                  "classify: %llu pixels differ by more than 1e-3: %llu with a wrong answer, %llu with a tie, %llu "
                  "within rounding, %llu after rays that differed, %llu though all rays found the same (at most "
                  "%.1e)\n",
                  number(pixels.total()), number(pixels.wrong), number(pixels.ties), number(pixels.rounding),
                  number(pixels.other_rays), number(pixels.shading), pixels.largest_shading);
    return text;
}

std::string as_json(const DifferingPixels& pixels) {
    JsonObject object;
    object.number("wrong", double(pixels.wrong));
    object.number("ties", double(pixels.ties));
    object.number("rounding", double(pixels.rounding));
    object.number("other_rays", double(pixels.other_rays));
    object.number("shading", double(pixels.shading));
    object.number("largest_shading", pixels.largest_shading);
    return object.text();
}

}  // namespace rtc::tools
