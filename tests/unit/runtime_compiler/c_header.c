/* The header as C: no warning, and nothing but its functions. */
#include "rtc/runtime_compiler.h"

VkResult (*rtr_test_from_stages(void))(RtrDevice, VkPipelineCache, const VkRayTracingPipelineCreateInfoNV*,
                                       const RtrStagesInfo*, const VkAllocationCallbacks*, RtrPipeline*);

VkResult (*rtr_test_from_stages(void))(RtrDevice, VkPipelineCache, const VkRayTracingPipelineCreateInfoNV*,
                                       const RtrStagesInfo*, const VkAllocationCallbacks*, RtrPipeline*) {
    return rtrCreateRayTracingPipelineFromStages;
}
