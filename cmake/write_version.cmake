# Runs in every build, as cmake -P: writes OUTPUT from TEMPLATE with VERSION, and with the commit of the sources in SOURCE and
# its date, unless it says the same already. COMMIT is taken instead of that commit, if it is not empty.
find_program(GIT git)
set(root "")
set(told "")
set(found "")
set(DATE "")
if(GIT)
  execute_process(COMMAND ${GIT} -C ${SOURCE} rev-parse --show-toplevel
                  OUTPUT_VARIABLE root OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
endif()
if(root)
  # A repository further up is not that of these sources.
  file(REAL_PATH ${root} root)
  file(REAL_PATH ${SOURCE} source)
  if(root STREQUAL source)
    execute_process(COMMAND ${GIT} -C ${SOURCE} log -1 "--format=%H %cs" OUTPUT_VARIABLE told ERROR_QUIET)
  endif()
endif()
if(told MATCHES "^([0-9a-f]+) ([0-9-]+)\n$")
  set(DATE ${CMAKE_MATCH_2})
  string(SUBSTRING ${CMAKE_MATCH_1} 0 12 found)
  # Without optional locks, a commit that is being made meanwhile is not disturbed.
  execute_process(COMMAND ${GIT} --no-optional-locks -C ${SOURCE} status --porcelain --untracked-files=no
                  OUTPUT_VARIABLE changes)
  if(changes)
    string(APPEND found -modified)
  endif()
endif()
if(NOT COMMIT)
  set(COMMIT ${found})
endif()
if(DEFINED ENV{SOURCE_DATE_EPOCH})  # which packages set
  string(TIMESTAMP DATE %Y-%m-%d UTC)
endif()
configure_file(${TEMPLATE} ${OUTPUT} @ONLY)
