/* What a module needs of a device, and what the device was created with: features behind
 * SPIR-V capabilities, extensions behind SPIR-V extensions, the version of SPIR-V. */
#include "internal.h"

/* Where a feature stands: a VkBool32 of a structure in a chain of features. Core ones of 1.0
 * are found in VkPhysicalDeviceFeatures2 too. */
typedef struct Place {
    VkStructureType type;
    size_t offset;
} Place;

typedef struct Feature {
    uint32_t capability; /* of SPIR-V; met by any row that names it */
    const char* name;
    Place place[2]; /* the structure of its extension, that of its version of Vulkan */
} Feature;

#define CORE(field) \
    {{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2, offsetof(VkPhysicalDeviceFeatures2, features.field)}, {0, 0}}
#define IN(kind, structure, field) \
    {{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_##kind, offsetof(VkPhysicalDevice##structure, field)}, {0, 0}}
#define IN_AND(kind, structure, kind2, structure2, field)                                      \
    {{VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_##kind, offsetof(VkPhysicalDevice##structure, field)}, \
     {VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_##kind2, offsetof(VkPhysicalDevice##structure2, field)}}
#define INDEXING(field) \
    IN_AND(DESCRIPTOR_INDEXING_FEATURES, DescriptorIndexingFeatures, VULKAN_1_2_FEATURES, Vulkan12Features, field)
#define STORAGE16(field) \
    IN_AND(16BIT_STORAGE_FEATURES, 16BitStorageFeatures, VULKAN_1_1_FEATURES, Vulkan11Features, field)
#define STORAGE8(field) \
    IN_AND(8BIT_STORAGE_FEATURES, 8BitStorageFeatures, VULKAN_1_2_FEATURES, Vulkan12Features, field)
#define SMALL(field) \
    IN_AND(SHADER_FLOAT16_INT8_FEATURES, ShaderFloat16Int8Features, VULKAN_1_2_FEATURES, Vulkan12Features, field)
#define ATOMIC64(field) \
    IN_AND(SHADER_ATOMIC_INT64_FEATURES, ShaderAtomicInt64Features, VULKAN_1_2_FEATURES, Vulkan12Features, field)
#define POINTERS(field) \
    IN_AND(VARIABLE_POINTERS_FEATURES, VariablePointersFeatures, VULKAN_1_1_FEATURES, Vulkan11Features, field)
#define MODEL(field) \
    IN_AND(VULKAN_MEMORY_MODEL_FEATURES, VulkanMemoryModelFeatures, VULKAN_1_2_FEATURES, Vulkan12Features, field)
#define ADDRESS(field) \
    IN_AND(BUFFER_DEVICE_ADDRESS_FEATURES, BufferDeviceAddressFeatures, VULKAN_1_2_FEATURES, Vulkan12Features, field)
#define DOT(field)                                                                                         \
    IN_AND(SHADER_INTEGER_DOT_PRODUCT_FEATURES, ShaderIntegerDotProductFeatures, VULKAN_1_3_FEATURES, \
           Vulkan13Features, field)
#define CLOCK(field) IN(SHADER_CLOCK_FEATURES_KHR, ShaderClockFeaturesKHR, field)
#define FLOATS(field) IN(SHADER_ATOMIC_FLOAT_FEATURES_EXT, ShaderAtomicFloatFeaturesEXT, field)
#define FLOATS2(field) IN(SHADER_ATOMIC_FLOAT_2_FEATURES_EXT, ShaderAtomicFloat2FeaturesEXT, field)
#define IMAGE64(field) IN(SHADER_IMAGE_ATOMIC_INT64_FEATURES_EXT, ShaderImageAtomicInt64FeaturesEXT, field)

/* Capabilities that a stage of ray tracing or its compute shader may declare, after the table
 * "SPIR-V Capabilities" of the Vulkan specification. */
#define FEATURES(X)                                                    \
    X(10, shaderFloat64, CORE)                                         \
    X(11, shaderInt64, CORE)                                           \
    X(22, shaderInt16, CORE)                                           \
    X(25, shaderImageGatherExtended, CORE)                             \
    X(27, shaderStorageImageMultisample, CORE)                         \
    X(28, shaderUniformBufferArrayDynamicIndexing, CORE)               \
    X(29, shaderSampledImageArrayDynamicIndexing, CORE)                \
    X(30, shaderStorageBufferArrayDynamicIndexing, CORE)               \
    X(31, shaderStorageImageArrayDynamicIndexing, CORE)                \
    X(34, imageCubeArray, CORE)                                        \
    X(41, shaderResourceResidency, CORE)                               \
    X(42, shaderResourceMinLod, CORE)                                  \
    X(45, imageCubeArray, CORE)                                        \
    X(48, shaderStorageImageMultisample, CORE)                         \
    X(49, shaderStorageImageExtendedFormats, CORE)                     \
    X(55, shaderStorageImageReadWithoutFormat, CORE)                   \
    X(56, shaderStorageImageWriteWithoutFormat, CORE)                  \
    X(9, shaderFloat16, SMALL)                                         \
    X(39, shaderInt8, SMALL)                                           \
    X(12, shaderBufferInt64Atomics, ATOMIC64)                          \
    X(12, shaderSharedInt64Atomics, ATOMIC64)                          \
    X(4433, storageBuffer16BitAccess, STORAGE16)                       \
    X(4434, uniformAndStorageBuffer16BitAccess, STORAGE16)             \
    X(4435, storagePushConstant16, STORAGE16)                          \
    X(4441, variablePointersStorageBuffer, POINTERS)                   \
    X(4442, variablePointers, POINTERS)                                \
    X(4448, storageBuffer8BitAccess, STORAGE8)                         \
    X(4449, uniformAndStorageBuffer8BitAccess, STORAGE8)               \
    X(4450, storagePushConstant8, STORAGE8)                            \
    X(5016, shaderImageInt64Atomics, IMAGE64)                          \
    X(5055, shaderSubgroupClock, CLOCK)                                \
    X(5055, shaderDeviceClock, CLOCK)                                  \
    X(5302, runtimeDescriptorArray, INDEXING)                          \
    X(5304, shaderUniformTexelBufferArrayDynamicIndexing, INDEXING)    \
    X(5305, shaderStorageTexelBufferArrayDynamicIndexing, INDEXING)    \
    X(5306, shaderUniformBufferArrayNonUniformIndexing, INDEXING)      \
    X(5307, shaderSampledImageArrayNonUniformIndexing, INDEXING)       \
    X(5308, shaderStorageBufferArrayNonUniformIndexing, INDEXING)      \
    X(5309, shaderStorageImageArrayNonUniformIndexing, INDEXING)       \
    X(5311, shaderUniformTexelBufferArrayNonUniformIndexing, INDEXING) \
    X(5312, shaderStorageTexelBufferArrayNonUniformIndexing, INDEXING) \
    X(5345, vulkanMemoryModel, MODEL)                                  \
    X(5346, vulkanMemoryModelDeviceScope, MODEL)                       \
    X(5347, bufferDeviceAddress, ADDRESS)                              \
    X(5612, shaderBufferFloat32AtomicMinMax, FLOATS2)                  \
    X(5612, shaderSharedFloat32AtomicMinMax, FLOATS2)                  \
    X(5612, shaderImageFloat32AtomicMinMax, FLOATS2)                   \
    X(5613, shaderBufferFloat64AtomicMinMax, FLOATS2)                  \
    X(6016, shaderIntegerDotProduct, DOT)                              \
    X(6017, shaderIntegerDotProduct, DOT)                              \
    X(6018, shaderIntegerDotProduct, DOT)                              \
    X(6019, shaderIntegerDotProduct, DOT)                              \
    X(6033, shaderBufferFloat32AtomicAdd, FLOATS)                      \
    X(6033, shaderSharedFloat32AtomicAdd, FLOATS)                      \
    X(6033, shaderImageFloat32AtomicAdd, FLOATS)                       \
    X(6034, shaderBufferFloat64AtomicAdd, FLOATS)

static const Feature k_features[] = {
#define X(capability, field, in) {capability, #field, in(field)},
    FEATURES(X)
#undef X
};
#define FEATURE_COUNT (sizeof k_features / sizeof k_features[0])
/* RtrDevice keeps a bit for each. */
typedef char feature_bits_suffice[FEATURE_COUNT <= 64 ? 1 : -1];

typedef struct Extension {
    const char* spirv;
    const char* vulkan;
    uint32_t core; /* version of Vulkan that has it; 0: none */
} Extension;

static const Extension k_extensions[] = {
    {"SPV_KHR_8bit_storage", "VK_KHR_8bit_storage", VK_API_VERSION_1_2},
    {"SPV_EXT_descriptor_indexing", "VK_EXT_descriptor_indexing", VK_API_VERSION_1_2},
    {"SPV_KHR_physical_storage_buffer", "VK_KHR_buffer_device_address", VK_API_VERSION_1_2},
    {"SPV_KHR_vulkan_memory_model", "VK_KHR_vulkan_memory_model", VK_API_VERSION_1_2},
    {"SPV_KHR_float_controls", "VK_KHR_shader_float_controls", VK_API_VERSION_1_2},
    {"SPV_KHR_non_semantic_info", "VK_KHR_shader_non_semantic_info", VK_API_VERSION_1_3},
    {"SPV_KHR_integer_dot_product", "VK_KHR_shader_integer_dot_product", VK_API_VERSION_1_3},
    {"SPV_KHR_shader_clock", "VK_KHR_shader_clock", 0},
    {"SPV_KHR_shader_ballot", "VK_EXT_shader_subgroup_ballot", 0},
    {"SPV_KHR_subgroup_vote", "VK_EXT_shader_subgroup_vote", 0},
    {"SPV_EXT_shader_atomic_float_add", "VK_EXT_shader_atomic_float", 0},
    {"SPV_EXT_shader_atomic_float_min_max", "VK_EXT_shader_atomic_float2", 0},
    {"SPV_EXT_shader_image_int64", "VK_EXT_shader_image_atomic_int64", 0},
};
#define EXTENSION_COUNT (sizeof k_extensions / sizeof k_extensions[0])

/* ---- What the device has ------------------------------------------------------------------ */

static uint64_t features_in(const void* chain) {
    const VkBaseInStructure* s;
    uint64_t bits = 0;
    uint32_t i, k;
    for (s = chain; s; s = s->pNext)
        for (i = 0; i < FEATURE_COUNT; i++)
            for (k = 0; k < 2; k++)
                if (k_features[i].place[k].type == s->sType && k_features[i].place[k].offset &&
                    *(const VkBool32*)(const void*)((const char*)s + k_features[i].place[k].offset))
                    bits |= 1ull << i;
    return bits;
}

static uint64_t extensions_in(const VkExtensionProperties* known, uint32_t known_count,
                              const char* const* names, uint32_t count, uint32_t version) {
    uint64_t bits = 0;
    uint32_t i, k;
    for (i = 0; i < EXTENSION_COUNT; i++) {
        const Extension* e = &k_extensions[i];
        bool has = e->core && version >= e->core;
        for (k = 0; k < known_count && !has; k++) has = strcmp(known[k].extensionName, e->vulkan) == 0;
        for (k = 0; k < count && !has; k++) has = strcmp(names[k], e->vulkan) == 0;
        if (has) bits |= 1ull << i;
    }
    return bits;
}

static bool lists(const VkExtensionProperties* known, uint32_t count, const char* name) {
    uint32_t i;
    for (i = 0; i < count; i++)
        if (strcmp(known[i].extensionName, name) == 0) return true;
    return false;
}

/* What the physical device offers stands for what was enabled. */
static VkResult query(RtrDevice d) {
    VkPhysicalDeviceFeatures2 all = {.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2};
#define STRUCTURE(name, structure, kind) \
    VkPhysicalDevice##structure name = {.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_##kind}
    STRUCTURE(storage16, 16BitStorageFeatures, 16BIT_STORAGE_FEATURES);
    STRUCTURE(pointers, VariablePointersFeatures, VARIABLE_POINTERS_FEATURES);
    STRUCTURE(storage8, 8BitStorageFeatures, 8BIT_STORAGE_FEATURES);
    STRUCTURE(small, ShaderFloat16Int8Features, SHADER_FLOAT16_INT8_FEATURES);
    STRUCTURE(atomic64, ShaderAtomicInt64Features, SHADER_ATOMIC_INT64_FEATURES);
    STRUCTURE(indexing, DescriptorIndexingFeatures, DESCRIPTOR_INDEXING_FEATURES);
    STRUCTURE(model, VulkanMemoryModelFeatures, VULKAN_MEMORY_MODEL_FEATURES);
    STRUCTURE(address, BufferDeviceAddressFeatures, BUFFER_DEVICE_ADDRESS_FEATURES);
    STRUCTURE(dot, ShaderIntegerDotProductFeatures, SHADER_INTEGER_DOT_PRODUCT_FEATURES);
    STRUCTURE(clock, ShaderClockFeaturesKHR, SHADER_CLOCK_FEATURES_KHR);
    STRUCTURE(floats, ShaderAtomicFloatFeaturesEXT, SHADER_ATOMIC_FLOAT_FEATURES_EXT);
    STRUCTURE(floats2, ShaderAtomicFloat2FeaturesEXT, SHADER_ATOMIC_FLOAT_2_FEATURES_EXT);
    STRUCTURE(image64, ShaderImageAtomicInt64FeaturesEXT, SHADER_IMAGE_ATOMIC_INT64_FEATURES_EXT);
#undef STRUCTURE
    const struct {
        void* structure;
        uint32_t core;
        const char* extension;
    } chain[] = {
        {&storage16, VK_API_VERSION_1_1, ""},
        {&pointers, VK_API_VERSION_1_1, ""},
        {&storage8, VK_API_VERSION_1_2, "VK_KHR_8bit_storage"},
        {&small, VK_API_VERSION_1_2, "VK_KHR_shader_float16_int8"},
        {&atomic64, VK_API_VERSION_1_2, "VK_KHR_shader_atomic_int64"},
        {&indexing, VK_API_VERSION_1_2, "VK_EXT_descriptor_indexing"},
        {&model, VK_API_VERSION_1_2, "VK_KHR_vulkan_memory_model"},
        {&address, VK_API_VERSION_1_2, "VK_KHR_buffer_device_address"},
        {&dot, VK_API_VERSION_1_3, "VK_KHR_shader_integer_dot_product"},
        {&clock, ~0u, "VK_KHR_shader_clock"},
        {&floats, ~0u, "VK_EXT_shader_atomic_float"},
        {&floats2, ~0u, "VK_EXT_shader_atomic_float2"},
        {&image64, ~0u, "VK_EXT_shader_image_atomic_int64"},
    };
    const VkAllocationCallbacks* a = d->has_allocator ? &d->allocator : NULL;
    VkExtensionProperties* known;
    uint32_t count = 0, i;
    VkResult r = d->vki.EnumerateDeviceExtensionProperties(d->physical_device, NULL, &count, NULL);
    if (r != VK_SUCCESS) return r;
    known = rtr_alloc(a, (count + 1) * sizeof *known);
    if (!known) return VK_ERROR_OUT_OF_HOST_MEMORY;
    r = d->vki.EnumerateDeviceExtensionProperties(d->physical_device, NULL, &count, known);
    for (i = 0; r == VK_SUCCESS && i < sizeof chain / sizeof chain[0]; i++) {
        if (d->api_version < chain[i].core && !lists(known, count, chain[i].extension)) continue;
        ((VkBaseOutStructure*)chain[i].structure)->pNext = all.pNext;
        all.pNext = chain[i].structure;
    }
    if (r == VK_SUCCESS) {
        d->vki.GetPhysicalDeviceFeatures2(d->physical_device, &all);
        d->features = features_in(&all);
        d->extensions = extensions_in(known, count, NULL, 0, d->api_version);
        d->spirv_1_4 = lists(known, count, "VK_KHR_spirv_1_4");
    }
    rtr_free(a, known);
    return r;
}

VkResult rtr_learn_features(RtrDevice d, const VkDeviceCreateInfo* made) {
    VkPhysicalDeviceSubgroupProperties subgroup = {.sType =
                                                       VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_SUBGROUP_PROPERTIES};
    VkPhysicalDeviceProperties2 properties = {.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2};
    uint32_t i;
    properties.pNext = &subgroup;
    d->vki.GetPhysicalDeviceProperties2(d->physical_device, &properties);
    d->api_version = properties.properties.apiVersion;
    if (subgroup.supportedStages & VK_SHADER_STAGE_COMPUTE_BIT)
        d->subgroup_operations = subgroup.supportedOperations;
    if (!made) return query(d);
    d->features_told = true;
    d->features = features_in(made->pNext);
    if (made->pEnabledFeatures) {
        VkPhysicalDeviceFeatures2 core = {.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2};
        core.features = *made->pEnabledFeatures;
        d->features |= features_in(&core);
    }
    d->extensions = extensions_in(NULL, 0, made->ppEnabledExtensionNames, made->enabledExtensionCount,
                                  d->api_version);
    for (i = 0; i < made->enabledExtensionCount; i++)
        if (strcmp(made->ppEnabledExtensionNames[i], "VK_KHR_spirv_1_4") == 0) d->spirv_1_4 = true;
    return VK_SUCCESS;
}

/* ---- What a module needs ---------------------------------------------------------------------- */

static VkResult reject(RtrDevice d, const char* id, const char* what, const char* name, const char* why) {
    return rtr_error(d, VK_ERROR_FEATURE_NOT_PRESENT, id, "the module needs the %s %s%s; the device %s", what,
                     name, why, d->features_told ? "was created without it" : "does not have it");
}

static VkResult check_capability(RtrDevice d, uint32_t capability) {
    /* GroupNonUniform, ...Vote, ...Arithmetic, ...Ballot, and on to ...Quad. */
    static const char* const operations[] = {"BASIC",           "VOTE",      "ARITHMETIC", "BALLOT", "SHUFFLE",
                                             "SHUFFLE_RELATIVE", "CLUSTERED", "QUAD"};
    const Feature* first = NULL;
    uint32_t i;
    if (capability >= 61 && capability < 61 + 8) {
        if (d->subgroup_operations >> (capability - 61) & 1) return VK_SUCCESS;
        return rtr_error(d, VK_ERROR_FEATURE_NOT_PRESENT, "missing-subgroup-operation",
                         "the module needs the subgroup operations VK_SUBGROUP_FEATURE_%s_BIT in compute "
                         "shaders; the device does not have them",
                         operations[capability - 61]);
    }
    for (i = 0; i < FEATURE_COUNT; i++) {
        if (k_features[i].capability != capability) continue;
        if (d->features >> i & 1) return VK_SUCCESS;
        if (!first) first = &k_features[i];
    }
    return first ? reject(d, "missing-feature", "feature", first->name, "") : VK_SUCCESS;
}

static VkResult check_extension(RtrDevice d, const char* name, size_t room) {
    uint32_t i;
    for (i = 0; i < EXTENSION_COUNT; i++) {
        if (strncmp(name, k_extensions[i].spirv, room) != 0 || d->extensions >> i & 1) continue;
        return reject(d, "missing-extension", "extension", k_extensions[i].vulkan,
                       k_extensions[i].core ? " or a later version of Vulkan" : "");
    }
    return VK_SUCCESS;
}

static VkResult check_version(RtrDevice d, uint32_t word) {
    const uint32_t minor = word >> 8 & 0xffu;
    uint32_t most = 3;
    if (d->api_version >= VK_API_VERSION_1_3)
        most = 6;
    else if (d->api_version >= VK_API_VERSION_1_2)
        most = 5;
    else if (d->spirv_1_4)
        most = 4;
    if (minor <= most) return VK_SUCCESS;
    return rtr_error(d, VK_ERROR_FEATURE_NOT_PRESENT, "spirv-version",
                     "the module is SPIR-V 1.%u; the device, of Vulkan %u.%u, takes up to 1.%u: link it for an "
                     "earlier --target-env",
                     minor, VK_API_VERSION_MAJOR(d->api_version), VK_API_VERSION_MINOR(d->api_version), most);
}

/* Every thing that is missing is reported; the words were parsed before. */
VkResult rtr_check_features(RtrDevice d, const uint32_t* code, size_t size) {
    const size_t words = size / 4;
    VkResult r = check_version(d, code[1]);
    size_t at;
    for (at = 5; at < words; at += code[at] >> 16) {
        const uint32_t length = code[at] >> 16, op = code[at] & 0xffffu;
        VkResult one = VK_SUCCESS;
        if (op == 14) break; /* OpMemoryModel: neither comes after it */
        if (op == 17 && length == 2) one = check_capability(d, code[at + 1]);
        if (op == 10 && length > 1) one = check_extension(d, (const char*)(code + at + 1), 4 * (length - 1));
        if (one != VK_SUCCESS) r = one;
    }
    return r;
}
