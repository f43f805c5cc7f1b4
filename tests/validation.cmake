# Read by ctest itself: every test runs under the Vulkan validation layers, synchronisation validation included,
# and fails when they say anything. RTC_VALIDATION=0 in the environment switches that off.
if(NOT DEFINED ENV{RTC_VALIDATION})
  file(GLOB layers /usr/share/vulkan/explicit_layer.d/*khronos_validation*.json
    /usr/local/share/vulkan/explicit_layer.d/*khronos_validation*.json
    /etc/vulkan/explicit_layer.d/*khronos_validation*.json)
  if(layers)
    set(ENV{RTC_VALIDATION} 1)
  endif()
endif()
