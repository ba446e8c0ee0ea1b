# Part of `cmake --install`: writes texts below the prefix.
cmake_policy(VERSION 3.25)

# Names the file in the manifest of the installation, as install(FILES) does.
function(relmap_write_installed file text)
  set(path "$ENV{DESTDIR}${CMAKE_INSTALL_PREFIX}/${file}")
  message(STATUS "Installing: ${path}")
  file(WRITE "${path}" "${text}")
  file(CHMOD "${path}" PERMISSIONS OWNER_READ OWNER_WRITE GROUP_READ WORLD_READ)
  list(APPEND CMAKE_INSTALL_MANIFEST_FILES "${CMAKE_INSTALL_PREFIX}/${file}")
  return(PROPAGATE CMAKE_INSTALL_MANIFEST_FILES)
endfunction()

# Installs a file in which @prefix@ stands for the prefix.
function(relmap_install_text source destination)
  file(READ "${source}" text)
  string(REPLACE "@prefix@" "${CMAKE_INSTALL_PREFIX}" text "${text}")
  get_filename_component(name "${source}" NAME)
  relmap_write_installed("${destination}/${name}" "${text}")
  return(PROPAGATE CMAKE_INSTALL_MANIFEST_FILES)
endfunction()
