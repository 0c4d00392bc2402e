# Writes the tests of a program for ctest, one for each of its suites, also of those that are made for types:
#   cmake -D PROGRAM=FILE -D LIST=FILE -D LABEL=NAME -D TIMEOUT=SECONDS -P suites.cmake
execute_process(COMMAND ${PROGRAM} --gtest_list_tests OUTPUT_VARIABLE listed COMMAND_ERROR_IS_FATAL ANY)
string(REGEX MATCHALL "(^|\n)[^ \n]+\\." suites "${listed}")
# What a program prints at its end if it skips all tests and none fails.
set(none_ran "PASSED  . 0 tests[.]\n.  SKIPPED . [0-9]+ tests?, listed below:\n(.  SKIPPED . [^\n]+\n)+$")
set(tests "")
foreach(suite ${suites})
    string(REGEX REPLACE "\n|\\.$" "" suite "${suite}")
    string(APPEND tests "add_test([==[${suite}]==] [==[${PROGRAM}]==] [==[--gtest_filter=${suite}.*]==])\n"
        "set_tests_properties([==[${suite}]==] PROPERTIES TIMEOUT ${TIMEOUT} LABELS ${LABEL} "
        "SKIP_REGULAR_EXPRESSION [==[${none_ran}]==])\n")
endforeach()
if(NOT tests)
    message(FATAL_ERROR "${PROGRAM} lists no tests:\n${listed}")
endif()
file(WRITE ${LIST} "${tests}")
