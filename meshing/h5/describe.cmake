# Writes OUTPUT from TEMPLATE with the output of `git describe` in SOURCE; leaves it out without git or a
# repository.
execute_process(COMMAND git describe --always --dirty --tags WORKING_DIRECTORY ${SOURCE}
    OUTPUT_VARIABLE description OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE failed)
set(DESCRIPTION "")
if(failed STREQUAL "0")
    set(DESCRIPTION " (${description})")
endif()
configure_file(${TEMPLATE} ${OUTPUT} @ONLY)
