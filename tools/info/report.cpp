#include "report.h"

#include <cstring>
#include <nlohmann/json.hpp>
#include <sstream>

#include "error.h"
#include "resources.h"

namespace rtc::tools {
namespace {

using Json = nlohmann::ordered_json;

std::vector<std::string> native_extensions(VkPhysicalDevice physical) {
    uint32_t count = 0;
    vkEnumerateDeviceExtensionProperties(physical, nullptr, &count, nullptr);
    std::vector<VkExtensionProperties> extensions(count);
    vkEnumerateDeviceExtensionProperties(physical, nullptr, &count, extensions.data());
    std::vector<std::string> found;
    for (const char* name : {VK_NV_RAY_TRACING_EXTENSION_NAME, VK_KHR_RAY_TRACING_PIPELINE_EXTENSION_NAME,
                             VK_KHR_ACCELERATION_STRUCTURE_EXTENSION_NAME, VK_KHR_RAY_QUERY_EXTENSION_NAME})
        for (const VkExtensionProperties& extension : extensions)
            if (std::strcmp(extension.extensionName, name) == 0) found.push_back(name);
    return found;
}

RtrFloatProbe run_probe(const DeviceInfo& info) {
    ContextOptions options;
    options.device = std::to_string(info.index);
    options.print_device = false;
    const Context context(options);
    RtrDeviceCreateInfo deviceInfo{};
    deviceInfo.instance = context.instance;
    deviceInfo.physicalDevice = context.physical;
    deviceInfo.device = context.device;
    deviceInfo.pfnGetInstanceProcAddr = vkGetInstanceProcAddr;
    RtrDevice device = nullptr;
    check(rtrCreateDevice(&deviceInfo, nullptr, &device), "rtrCreateDevice");
    RtrFloatProbe probe{};
    {
        const Buffer buffer(context, RTR_FLOAT_PROBE_BYTES, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT,
                            MemoryKind::Host);
        RtrRecorderCreateInfo recorderInfo{};
        RtrRecorder recorder = nullptr;
        check(rtrCreateRecorder(device, &recorderInfo, nullptr, &recorder), "rtrCreateRecorder");
        context.run([&](VkCommandBuffer commands) {
            check(rtrBeginRecorder(recorder, commands), "rtrBeginRecorder");
            check(rtrCmdProbeFloat(recorder, buffer.handle, 0), "rtrCmdProbeFloat");
            full_barrier(commands);
        });
        rtrDecodeFloatProbe(buffer.mapped, &probe);
        rtrDestroyRecorder(device, recorder, nullptr);
    }
    rtrDestroyDevice(device, nullptr);
    return probe;
}

const char* yes_no(VkBool32 value) { return value ? "yes" : "no"; }
std::string fetch_name(const RtrPhysicalDeviceSupport& support) {
    const std::string heap = support.recommended.fetch == RTR_FETCH_TEXEL ? "through a texel buffer" : "through a storage buffer";
    return support.recommendAddresses ? "by device address (else " + heap + ")" : heap;
}
std::string mebibytes(VkDeviceSize bytes) { return std::to_string(bytes >> 20) + " MiB"; }

// Versions are packed into the number; everything else is a plain limit.
std::string limit_text(const RtrRequirement& requirement, uint64_t value) {
    if (std::strcmp(requirement.name, "apiVersion") != 0) return std::to_string(value);
    return std::to_string(VK_API_VERSION_MAJOR(value)) + "." + std::to_string(VK_API_VERSION_MINOR(value)) +
           "." + std::to_string(VK_API_VERSION_PATCH(value));
}

std::string modes(const RtrPhysicalDeviceSupport& support) {
    if (!support.supported) return "none";
    return support.addressMode ? "heap, address" : "heap";
}

}  // namespace

DeviceReport examine(const DeviceList& list, const DeviceInfo& device, bool probe) {
    DeviceReport report;
    report.device = device;
    check(rtrGetPhysicalDeviceSupport(list.instance, device.physical, vkGetInstanceProcAddr, &report.support),
          "rtrGetPhysicalDeviceSupport");
    report.native = native_extensions(device.physical);
    if (!report.support.supported) {
        report.probe_problem = "rtc does not run here";
    } else if (!probe) {
        report.probe_problem = "not asked for";
    } else {
        try {
            report.probe = run_probe(device);
            report.probed = true;
        } catch (const Error& problem) {
            report.probe_problem = problem.what();
        }
    }
    return report;
}

std::string as_text(const DeviceReport& report) {
    const RtrPhysicalDeviceSupport& support = report.support;
    std::ostringstream text;
    text << "device " << report.device.index << ": "
         << describe_device(report.device.properties, report.device.driver) << "\n";
    text << "  rtc runs:             " << yes_no(support.supported) << "\n";
    for (uint32_t i = 0; i < support.requirementCount; ++i) {
        const RtrRequirement& requirement = support.requirements[i];
        if (!requirement.met)
            text << "  missing:              " << requirement.name << " "
                 << limit_text(requirement, requirement.required) << " (has "
                 << limit_text(requirement, requirement.available) << ")\n";
    }
    text << "  mode:                 " << modes(support) << "\n";
    text << "  native ray tracing:   ";
    if (report.native.empty()) text << "none";
    for (size_t i = 0; i < report.native.size(); ++i) text << (i ? ", " : "") << report.native[i];
    text << "\n";
    if (!support.supported) return text.str();

    const RtrTraceOptions& options = support.recommended;
    text << "  recommended:          nodes " << fetch_name(support) << ", "
         << (options.whileWhile ? "while-while" : "if-if") << " loop, "
         << (options.sharedStack ? std::to_string(options.sharedStack) + " stack entries in shared memory"
                                 : std::string("stack in a local array"))
         << ", workgroups of " << options.workgroupSize << "\n";
    text << "  long loops:           "
         << (support.needsResumableModules
                 ? "cut off or killed by the device: modules must be resumable, step budget " +
                       std::to_string(options.stepBudget)
                 : std::string("fine"))
         << "\n";
    text << "  heap at most:         " << mebibytes(support.maxHeapSizeTexel) << " by texels, "
         << mebibytes(support.maxHeapSizeStorage) << " by storage buffer\n";
    text << "  subgroup size:        " << support.subgroupSize << "\n";
    text << "  limits:               ";
    for (uint32_t i = 0; i < support.requirementCount; ++i) {
        const RtrRequirement& requirement = support.requirements[i];
        text << (i ? "                        " : "") << requirement.name << " "
             << limit_text(requirement, requirement.available) << " (needs "
             << limit_text(requirement, requirement.required) << ")\n";
    }
    if (!report.probed) {
        text << "  float arithmetic:     not probed: " << report.probe_problem << "\n";
        return text.str();
    }
    const RtrFloatProbe& probe = report.probe;
    text << "  float arithmetic:     contracts a*b+c: " << yes_no(probe.contractsUnmarked)
         << ", even where forbidden: " << yes_no(probe.contractsPrecise)
         << "; fma fused: " << yes_no(probe.fmaIsFused)
         << "\n                        denormals flushed: " << yes_no(probe.flushesDenormals)
         << ", round to nearest even: " << yes_no(probe.roundsToNearestEven)
         << ", exact division: " << yes_no(probe.exactDivision)
         << "\n                        signed zero kept: " << yes_no(probe.keepsSignedZero)
         << ", NaN comparisons false: " << yes_no(probe.nanFailsComparison) << "\n";
    if (probe.contractsPrecise)
        text << "  warning:              this driver contracts where it must not: watertightness is lost\n";
    return text.str();
}

std::string as_json(const std::vector<DeviceReport>& reports) {
    Json devices = Json::array();
    for (const DeviceReport& report : reports) {
        const RtrPhysicalDeviceSupport& support = report.support;
        Json device;
        device["index"] = report.device.index;
        device["name"] = report.device.properties.deviceName;
        device["driver"] = report.device.driver.driverName;
        device["driver_info"] = report.device.driver.driverInfo;
        device["supported"] = support.supported == VK_TRUE;
        device["requirements"] = Json::array();
        for (uint32_t i = 0; i < support.requirementCount; ++i) {
            const RtrRequirement& requirement = support.requirements[i];
            device["requirements"].push_back({{"name", requirement.name},
                                              {"required", requirement.required},
                                              {"available", requirement.available},
                                              {"met", requirement.met == VK_TRUE}});
        }
        device["heap_mode"] = support.heapMode == VK_TRUE;
        device["buffer_device_address"] = support.addressMode == VK_TRUE;
        device["native_ray_tracing"] = report.native;
        device["needs_resumable_modules"] = support.needsResumableModules == VK_TRUE;
        device["recommended"] = {
            {"addressing", support.recommendAddresses ? "address" : "heap"},
            {"fetch", support.recommended.fetch == RTR_FETCH_TEXEL ? "texel" : "storage"},
            {"while_while", support.recommended.whileWhile},
            {"shared_stack", support.recommended.sharedStack},
            {"workgroup_size", support.recommended.workgroupSize},
            {"step_budget", support.recommended.stepBudget}};
        device["max_heap_bytes_texel"] = support.maxHeapSizeTexel;
        device["max_heap_bytes_storage"] = support.maxHeapSizeStorage;
        device["subgroup_size"] = support.subgroupSize;
        if (report.probed)
            device["float_probe"] = {{"contracts_unmarked", report.probe.contractsUnmarked == VK_TRUE},
                                     {"contracts_precise", report.probe.contractsPrecise == VK_TRUE},
                                     {"fma_is_fused", report.probe.fmaIsFused == VK_TRUE},
                                     {"flushes_denormals", report.probe.flushesDenormals == VK_TRUE},
                                     {"rounds_to_nearest_even", report.probe.roundsToNearestEven == VK_TRUE},
                                     {"exact_division", report.probe.exactDivision == VK_TRUE},
                                     {"keeps_signed_zero", report.probe.keepsSignedZero == VK_TRUE},
                                     {"nan_fails_comparison", report.probe.nanFailsComparison == VK_TRUE}};
        devices.push_back(device);
    }
    return Json{{"devices", devices}}.dump(2) + "\n";
}

}  // namespace rtc::tools
