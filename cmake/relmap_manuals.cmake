# relmap_manuals()
#   The manual pages and completions of the programs, written by the programs themselves into build/share as they are
#   installed below share/. Whoever installs compresses the pages.
include(GNUInstallDirs)

# relmap_manual(PROGRAM SECTION COMPONENT)
function(relmap_manual program section component)
  set(share ${CMAKE_BINARY_DIR}/share)
  set(manual man/man${section}/${program}.${section})
  set(bash bash-completion/completions/${program})
  set(zsh zsh/vendor-completions/_${program})
  set(fish fish/vendor_completions.d/${program}.fish)
  add_custom_command(
    OUTPUT ${share}/${manual} ${share}/${bash} ${share}/${zsh} ${share}/${fish}
    COMMAND ${CMAKE_COMMAND} -DPROGRAM=$<TARGET_FILE:${program}> -DMANUAL=${share}/${manual} -DBASH=${share}/${bash}
            -DZSH=${share}/${zsh} -DFISH=${share}/${fish} -P ${CMAKE_SOURCE_DIR}/cmake/write_manual.cmake
    DEPENDS ${program} ${CMAKE_SOURCE_DIR}/cmake/write_manual.cmake
    COMMENT "Writing the manual page and completions of ${program}" VERBATIM)
  add_custom_target(${program}-manual ALL DEPENDS ${share}/${manual})
  add_dependencies(relmap_manuals ${program}-manual)
  install(FILES ${share}/${manual} DESTINATION ${CMAKE_INSTALL_MANDIR}/man${section} COMPONENT ${component})
  foreach(completion ${bash} ${zsh} ${fish})
    cmake_path(GET completion PARENT_PATH folder)
    install(FILES ${share}/${completion} DESTINATION ${CMAKE_INSTALL_DATADIR}/${folder} COMPONENT ${component})
  endforeach()
endfunction()

function(relmap_manuals)
  add_custom_target(relmap_manuals)
  if(NOT RELMAP_SERVERS)
    return()
  endif()
  relmap_manual(relmapd 8 server)
  relmap_manual(relmap-frontend 1 frontend)
  relmap_manual(relmap-camera 1 frontend)
  relmap_manual(relmap-console 1 console)
  relmap_manual(relmap 1 tools)
  relmap_manual(relmap-admin 8 tools)
  relmap_manual(relmap-vocab 1 tools)
  relmap_manual(relmap-sim 1 tools)
endfunction()
