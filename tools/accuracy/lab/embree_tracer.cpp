// Embree as a RayTracer. One scene a bottom level, instances of them in a scene above; a single instance that is not
// moved is traced directly, as rtc does.
#include "embree_tracer.h"

#include "error.h"
#include "oracle.h"

#ifdef RTC_EMBREE
#include <embree3/rtcore.h>

#include <atomic>
#include <bit>
#include <chrono>
#include <cmath>
#include <cstring>
#endif

namespace rtc::lab {

#ifdef RTC_EMBREE
namespace {

// What the filter needs, in front of it Embree's own part.
struct Context {
    RTCIntersectContext embree;
    RayResult* result;
    bool ignore;
};

struct GeometryData {
    const std::vector<Triangle>* triangles;
};

// By the vertices in double: Embree's normal is rounded.
bool is_front(const Triangle& t, const float d[3]) {
    double e1[3], e2[3];
    for (int i = 0; i < 3; ++i) {
        e1[i] = double(t[1][i]) - double(t[0][i]);
        e2[i] = double(t[2][i]) - double(t[0][i]);
    }
    const double along = (e1[1] * e2[2] - e1[2] * e2[1]) * d[0] + (e1[2] * e2[0] - e1[0] * e2[2]) * d[1] +
                         (e1[0] * e2[1] - e1[1] * e2[0]) * d[2];
    return along < 0;
}

void count(const RTCFilterFunctionNArguments* args) {
    auto* context = reinterpret_cast<Context*>(args->context);
    const auto& data = *static_cast<const GeometryData*>(args->geometryUserPtr);
    const float d[3] = {RTCRayN_dir_x(args->ray, 1, 0), RTCRayN_dir_y(args->ray, 1, 0), RTCRayN_dir_z(args->ray, 1, 0)};
    if (is_front((*data.triangles)[RTCHitN_primID(args->hit, 1, 0)], d)) {
        context->result->front++;
    } else {
        context->result->back++;
    }
    if (context->ignore) args->valid[0] = 0;
}

bool memory(void* user, ssize_t bytes, bool) {
    static_cast<std::atomic<int64_t>*>(user)->fetch_add(bytes);
    return true;
}

class EmbreeTracer final : public RayTracer {
  public:
    EmbreeTracer(EmbreeMode mode, unsigned threads) : mode_(mode), threads_(threads), device_(rtcNewDevice(nullptr)) {
        if (!device_) throw tools::Error("Embree: no device");
        rtcSetDeviceMemoryMonitorFunction(device_, memory, &bytes_);
    }
    ~EmbreeTracer() override {
        clear();
        rtcReleaseDevice(device_);
    }

    void set_scene(const HostScene& scene) override {
        clear();
        blases_ = scene.blases;
        instances_ = scene.instances;
        const int64_t before = bytes_;
        for (const Blas& blas : blases_) {
            RTCScene bottom = new_scene();
            for (const Geometry& geometry : blas.geometries) {
                RTCGeometry g = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
                const size_t count = geometry.triangles.size();
                auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(
                    g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, std::max<size_t>(1, count * 3)));
                auto* indices = static_cast<uint32_t*>(
                    rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, std::max<size_t>(1, count)));
                std::memset(indices, 0, 12);
                std::memset(vertices, 0, 12);
                if (count) std::memcpy(vertices, geometry.triangles.data(), count * sizeof(Triangle));
                for (uint32_t i = 0; i < count * 3; ++i) indices[i] = i;
                data_.push_back(std::make_unique<GeometryData>(GeometryData{&geometry.triangles}));
                rtcSetGeometryUserData(g, data_.back().get());
                rtcCommitGeometry(g);
                rtcAttachGeometry(bottom, g);
                rtcReleaseGeometry(g);
            }
            rtcCommitScene(bottom);
            bottoms_.push_back(bottom);
        }
        direct_ = instances_.size() == 1 && instances_[0].object_to_world == kIdentity;
        if (!direct_) {
            top_ = new_scene();
            for (const Instance& instance : instances_) {
                RTCGeometry g = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_INSTANCE);
                rtcSetGeometryInstancedScene(g, bottoms_[instance.blas]);
                float rows[12];
                std::memcpy(rows, instance.object_to_world.data(), sizeof rows);
                rtcSetGeometryTransform(g, 0, RTC_FORMAT_FLOAT3X4_ROW_MAJOR, rows);
                rtcCommitGeometry(g);
                rtcAttachGeometry(top_, g);
                rtcReleaseGeometry(g);
            }
            rtcCommitScene(top_);
        }
        scene_bytes_ = uint64_t(bytes_ - before);
        stretch_ = shift_ = 0;
        for (const Transform& m : scene.world_to_object)
            for (const auto& row : m) {
                stretch_ = std::max(stretch_, std::fabs(double(row[0])) + std::fabs(double(row[1])) + std::fabs(double(row[2])));
                shift_ = std::max(shift_, std::fabs(double(row[3])));
            }
    }

    std::vector<RayResult> trace(const std::vector<Ray>& rays) override {
        std::vector<RayResult> results(rays.size());
        const RTCScene scene = direct_ ? bottoms_[instances_[0].blas] : top_;
        const auto start = std::chrono::steady_clock::now();
        in_parallel(
            rays.size(),
            [&](size_t begin, size_t end) {
                for (size_t i = begin; i < end; ++i) trace_one(scene, rays[i], results[i]);
            },
            threads_);
        seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        return results;
    }

    uint64_t scene_bytes() const override { return scene_bytes_; }

  private:
    RTCScene new_scene() {
        RTCScene scene = rtcNewScene(device_);
        int flags = RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION;
        if (mode_ == EmbreeMode::Robust) flags |= RTC_SCENE_FLAG_ROBUST;
        rtcSetSceneFlags(scene, RTCSceneFlags(flags));
        return scene;
    }

    // Embree asserts that rays, also those of instances, stay below this; others miss here.
    bool valid(const Ray& ray) const {
        double origin = 0, direction = 0;
        for (int i = 0; i < 3; ++i) {
            origin = std::max(origin, std::fabs(double(ray.origin[i])));
            direction = std::max(direction, std::fabs(double(ray.direction[i])));
        }
        const double limit = 1.8e18;
        return std::isfinite(ray.origin.x + ray.origin.y + ray.origin.z) &&
               std::isfinite(ray.direction.x + ray.direction.y + ray.direction.z) && !std::isnan(ray.tmin) &&
               !std::isnan(ray.tmax) && std::max(1.0, stretch_) * origin + shift_ < limit &&
               std::max(1.0, stretch_) * direction < limit;
    }

    void trace_one(RTCScene scene, const Ray& ray, RayResult& result) {
        std::memset(&result, 0, sizeof result);
        result.t = ray.tmax;
        result.instance = kNoInstance;
        if (!valid(ray)) return;
        Context context;
        rtcInitIntersectContext(&context.embree);
        context.result = &result;
        context.ignore = (ray.sbt & kIgnore) != 0;
        if (context.ignore) context.embree.filter = count;
        RTCRayHit hit{};
        hit.ray.org_x = ray.origin.x;
        hit.ray.org_y = ray.origin.y;
        hit.ray.org_z = ray.origin.z;
        hit.ray.dir_x = ray.direction.x;
        hit.ray.dir_y = ray.direction.y;
        hit.ray.dir_z = ray.direction.z;
        hit.ray.tnear = ray.tmin;
        hit.ray.tfar = ray.tmax;
        hit.ray.mask = ~0u;
        hit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
        hit.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
        rtcIntersect1(scene, &context.embree, &hit);
        const bool found = hit.hit.geomID != RTC_INVALID_GEOMETRY_ID;
        result.t = hit.ray.tfar;
        result.instance = found ? (direct_ ? 0 : hit.hit.instID[0]) : kNoInstance;
        result.geometry = found ? hit.hit.geomID : 0;
        result.primitive = found ? hit.hit.primID : 0;
        result.attr0 = std::bit_cast<uint32_t>(hit.hit.u);
        result.attr1 = std::bit_cast<uint32_t>(hit.hit.v);
    }

    void clear() {
        if (top_) rtcReleaseScene(top_);
        top_ = nullptr;
        for (RTCScene scene : bottoms_) rtcReleaseScene(scene);
        bottoms_.clear();
        data_.clear();
    }

    EmbreeMode mode_;
    unsigned threads_;
    RTCDevice device_;
    std::atomic<int64_t> bytes_{0};
    std::vector<Blas> blases_;
    std::vector<Instance> instances_;
    std::vector<std::unique_ptr<GeometryData>> data_;
    std::vector<RTCScene> bottoms_;
    RTCScene top_ = nullptr;
    bool direct_ = false;
    uint64_t scene_bytes_ = 0;
    double stretch_ = 0, shift_ = 0;  // of directions and origins on the way into an instance, at most
};

}  // namespace

bool have_embree() { return true; }

std::unique_ptr<RayTracer> make_embree_tracer(EmbreeMode mode, unsigned threads) {
    return std::make_unique<EmbreeTracer>(mode, threads);
}
#else
bool have_embree() { return false; }

std::unique_ptr<RayTracer> make_embree_tracer(EmbreeMode, unsigned) {
    throw tools::Error("built without Embree: install libembree-dev 3 and configure again");
}
#endif

}  // namespace rtc::lab
