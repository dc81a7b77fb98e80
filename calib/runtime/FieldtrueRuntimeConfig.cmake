include(${CMAKE_CURRENT_LIST_DIR}/FieldtrueRuntimeTargets.cmake)
