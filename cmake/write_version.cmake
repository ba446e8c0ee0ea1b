# Runs in every build, as cmake -P: writes OUTPUT from TEMPLATE with VERSION and the commit of the sources in SOURCE, unless
# it says the same already. COMMIT is taken instead, if it is not empty.
if(NOT COMMIT)
  find_program(GIT git)
  if(GIT)
    # A repository further up is not that of these sources.
    execute_process(COMMAND ${GIT} -C ${SOURCE} rev-parse --show-toplevel HEAD
                    OUTPUT_VARIABLE told OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
    if(told MATCHES "^(.*)\n([0-9a-f]+)$")
      set(root ${CMAKE_MATCH_1})
      string(SUBSTRING ${CMAKE_MATCH_2} 0 12 commit)
      file(REAL_PATH ${root} root)
      file(REAL_PATH ${SOURCE} source)
      if(root STREQUAL source)
        set(COMMIT ${commit})
        # Without optional locks, a commit that is being made meanwhile is not disturbed.
        execute_process(COMMAND ${GIT} --no-optional-locks -C ${SOURCE} status --porcelain --untracked-files=no
                        OUTPUT_VARIABLE changes)
        if(changes)
          string(APPEND COMMIT -modified)
        endif()
      endif()
    endif()
  endif()
endif()
configure_file(${TEMPLATE} ${OUTPUT} @ONLY)
