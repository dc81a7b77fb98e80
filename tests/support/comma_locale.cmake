# A locale with a decimal comma, in a folder that the tests name in LOCPATH: the machine may have none installed. Without
# the sources of the package locales it cannot be made, and the tests say that they are skipped.
set(comma_locales ${CMAKE_CURRENT_BINARY_DIR}/locales)
file(MAKE_DIRECTORY ${comma_locales})
add_custom_command(OUTPUT ${comma_locales}/made
  COMMAND sh -c "localedef -i de_DE -f UTF-8 ${comma_locales}/de_DE.UTF-8 && touch ${comma_locales}/made || true"
  VERBATIM)
add_custom_target(fieldtrue_comma_locale DEPENDS ${comma_locales}/made)
foreach(test acquisition/protocols/plain_number_test app/cli_locale_test)
  get_filename_component(program ${test} DIRECTORY)
  string(REPLACE "/" "_" program ${program}_tests)
  if(FIELDTRUE_QUICK)
    set(program quick_tests)
  endif()
  if(TARGET ${program})
    add_dependencies(${program} fieldtrue_comma_locale)
    set_source_files_properties(${CMAKE_CURRENT_SOURCE_DIR}/${test}.cpp PROPERTIES
      COMPILE_DEFINITIONS FIELDTRUE_COMMA_LOCALES="${comma_locales}")
  endif()
endforeach()
