# cmake -DNM=nm -DPROGRAM=fieldtrue-blind -P shares_no_code.cmake
# Fails when the program holds a symbol of calib, or no symbols at all, which would prove nothing.
execute_process(COMMAND ${NM} -C ${PROGRAM} OUTPUT_VARIABLE symbols RESULT_VARIABLE status)
if(NOT status EQUAL 0)
  message(FATAL_ERROR "${NM} cannot read ${PROGRAM}")
endif()
if(NOT symbols MATCHES "blind::runScore")
  message(FATAL_ERROR "${PROGRAM} holds no symbol of its own; a stripped program shows nothing")
endif()
if(symbols MATCHES "[^\n]*fieldtrue::[^\n]*")
  message(STATUS "${PROGRAM} holds code of calib: ${CMAKE_MATCH_0}")
  message(FATAL_ERROR "fieldtrue-blind must share no code with calib")
endif()
