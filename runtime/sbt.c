/* Shader binding tables: layout for records of any size, and writing them. */
#include "internal.h"

static VkResult lay_out(RtrDevice d, const char* name, uint32_t count, const RtrSbtRecord* records,
                        uint32_t alignment, VkDeviceSize* at, RtrSbtRegion* region) {
    uint32_t i, largest = 0;
    for (i = 0; i < count; i++)
        if (records[i].dataSize > largest) largest = records[i].dataSize;
    if (largest > RTC_SBT_MAX_STRIDE - RTC_HANDLE_BYTES)
        return rtr_error(
            d, VK_ERROR_VALIDATION_FAILED_EXT, "sbt-record",
            "%s region: a record of %u bytes; maxShaderGroupStride is %u, of which the handle takes %u", name,
            largest, RTC_SBT_MAX_STRIDE, RTC_HANDLE_BYTES);
    region->offset = *at;
    region->stride = count ? rtr_align(RTC_HANDLE_BYTES + largest, alignment) : 0;
    region->size = region->stride * count;
    *at = rtr_align(*at + region->size, RTC_SBT_BASE_ALIGNMENT);
    return VK_SUCCESS;
}

VkResult rtrGetSbtLayout(RtrDevice d, const RtrSbtInfo* info, RtrSbtLayout* layout) {
    VkDeviceSize at = 0;
    VkResult r;
    memset(layout, 0, sizeof *layout);
    /* A launch names one raygen record by its offset, so each starts at the base alignment. */
    if ((r = lay_out(d, "raygen", info->raygenCount, info->pRaygen, RTC_SBT_BASE_ALIGNMENT, &at,
                     &layout->raygen)) ||
        (r = lay_out(d, "miss", info->missCount, info->pMiss, RTC_SBT_HANDLE_ALIGNMENT, &at,
                     &layout->miss)) ||
        (r = lay_out(d, "hit", info->hitCount, info->pHit, RTC_SBT_HANDLE_ALIGNMENT, &at, &layout->hit)) ||
        (r = lay_out(d, "callable", info->callableCount, info->pCallable, RTC_SBT_HANDLE_ALIGNMENT, &at,
                     &layout->callable)))
        return r;
    layout->size = at;
    return VK_SUCCESS;
}

static VkResult write_region(RtrDevice d, RtrPipeline p, uint32_t count, const RtrSbtRecord* records,
                             const RtrSbtRegion* region, unsigned char* data) {
    uint32_t i;
    for (i = 0; i < count; i++) {
        unsigned char* at = data + region->offset + i * region->stride;
        memset(at, 0, (size_t)region->stride);
        if (records[i].group != RTR_NULL_GROUP) {
            if (records[i].group >= p->header.group_count)
                return rtr_error(d, VK_ERROR_VALIDATION_FAILED_EXT, "sbt-group",
                                 "SBT record %u names group %u; the pipeline has %u", i, records[i].group,
                                 p->header.group_count);
            memcpy(at, p->groups[records[i].group].handle, RTC_HANDLE_BYTES);
        }
        if (records[i].pData && records[i].dataSize)
            memcpy(at + RTC_HANDLE_BYTES, records[i].pData, records[i].dataSize);
    }
    return VK_SUCCESS;
}

VkResult rtrWriteSbt(RtrDevice d, RtrPipeline p, const RtrSbtInfo* info, const RtrSbtLayout* layout,
                     void* pData) {
    VkResult r;
    if ((r = write_region(d, p, info->raygenCount, info->pRaygen, &layout->raygen, pData)) ||
        (r = write_region(d, p, info->missCount, info->pMiss, &layout->miss, pData)) ||
        (r = write_region(d, p, info->hitCount, info->pHit, &layout->hit, pData)) ||
        (r = write_region(d, p, info->callableCount, info->pCallable, &layout->callable, pData)))
        return r;
    return VK_SUCCESS;
}
