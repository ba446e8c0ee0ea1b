# Runs after a test program is linked, as cmake -P: lists its gtest suites and writes OUTPUT, which ctest includes: an
# entry NAME.SUITE for each, with the labels LABELS. Suites named Long* get LONG_TIMEOUT, and the label `full` instead of
# the first of LABELS.
execute_process(COMMAND ${PROGRAM} --gtest_list_tests OUTPUT_VARIABLE listed RESULT_VARIABLE failed TIMEOUT 60)
if(failed)
  message(FATAL_ERROR "${PROGRAM} --gtest_list_tests: ${failed}")
endif()
string(REGEX MATCHALL "(^|\n)[A-Za-z0-9_/]+\\." suites "${listed}")
set(entries "")
foreach(suite IN LISTS suites)
  string(REGEX REPLACE "[\n.]" "" suite "${suite}")
  set(timeout ${TIMEOUT})
  set(labels ${LABELS})
  if(suite MATCHES "(^|/)Long")
    set(timeout ${LONG_TIMEOUT})
    list(POP_FRONT labels)
    list(PREPEND labels full)
  endif()
  string(APPEND entries "add_test([==[${NAME}.${suite}]==] [==[${PROGRAM}]==] [==[--gtest_filter=${suite}.*]==])\n"
         "set_tests_properties([==[${NAME}.${suite}]==] PROPERTIES TIMEOUT ${timeout} LABELS [==[${labels}]==] "
         "RUN_SERIAL ${ALONE} WORKING_DIRECTORY [==[${FOLDER}]==])\n")
endforeach()
file(WRITE ${OUTPUT} "${entries}")
