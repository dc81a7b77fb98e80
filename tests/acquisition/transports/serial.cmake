# The test of the real libserialport starts itself again with this library preloaded: a pseudo-terminal has no modem lines.
add_library(fieldtrue_fake_modem_lines MODULE ${CMAKE_CURRENT_SOURCE_DIR}/support/fake_modem_lines.c)
target_link_libraries(fieldtrue_fake_modem_lines PRIVATE ${CMAKE_DL_LIBS})
target_compile_definitions(acquisition_libserialport_line_test PRIVATE
  FIELDTRUE_FAKE_MODEM_LINES="$<TARGET_FILE:fieldtrue_fake_modem_lines>")
target_link_libraries(acquisition_libserialport_line_test PRIVATE PkgConfig::SERIALPORT)
add_dependencies(acquisition_libserialport_line_test fieldtrue_fake_modem_lines)
