# What `cmake --install build/release --prefix P [--component C]` installs. Components, each a package of debian/:
#   server    relmapd, the vocabulary, its unit, user, folders and kernel settings, a sample of its configuration
#   frontend  relmap-frontend and relmap-camera, who may open cameras, the unit of a robot
#   console   relmap-console, its unit, user and a sample of its options
#   tools     relmap, relmap-admin, relmap-vocab, relmap-sim
#   python    the Python client
#   dev       the C++ client: a static library, its headers, a CMake package, a pkg-config file; the .proto and .lcm files
# relmap-bench is for those who work on relmap, and is not installed. `ninja relmap_installed` builds what is needed.
include(CMakePackageConfigHelpers)

# A file of our own in which @prefix@ becomes the prefix, which is known only when it is installed.
function(relmap_install_text component file destination)
  install(CODE "include(${CMAKE_SOURCE_DIR}/cmake/installed/install_text.cmake)
relmap_install_text([==[${CMAKE_SOURCE_DIR}/${file}]==] [==[${destination}]==])" COMPONENT ${component})
endfunction()

# Documents keep their folders, so that the links between them lead somewhere.
function(relmap_install_documents component)
  foreach(document ${ARGN})
    get_filename_component(folder ${document} DIRECTORY)
    install(FILES ${CMAKE_SOURCE_DIR}/${document} DESTINATION share/doc/relmap/${folder} COMPONENT ${component})
  endforeach()
endfunction()

set(systemd tools/ops/systemd)

install(TARGETS relmapd RUNTIME DESTINATION bin COMPONENT server)
install(FILES ${CMAKE_SOURCE_DIR}/server/place/data/places.vocab DESTINATION share/relmap RENAME default.vocab
        COMPONENT server)
install(FILES ${CMAKE_SOURCE_DIR}/tools/ops/relmapd.yaml DESTINATION share/relmap COMPONENT server)
foreach(unit relmapd.service relmap-backup.service relmap-backup.timer)
  relmap_install_text(server ${systemd}/${unit} lib/systemd/system)
endforeach()
install(FILES ${CMAKE_SOURCE_DIR}/${systemd}/relmapd.sysusers DESTINATION lib/sysusers.d RENAME relmapd.conf
        COMPONENT server)
install(FILES ${CMAKE_SOURCE_DIR}/${systemd}/relmapd.tmpfiles DESTINATION lib/tmpfiles.d RENAME relmapd.conf
        COMPONENT server)
install(FILES ${CMAKE_SOURCE_DIR}/${systemd}/10-relmap.conf DESTINATION lib/sysctl.d COMPONENT server)
foreach(file alerts.yml dashboard.json prometheus.yml)
  install(FILES ${CMAKE_SOURCE_DIR}/tools/ops/${file} DESTINATION share/relmap/ops COMPONENT server)
endforeach()
relmap_install_documents(server docs/operations.md docs/runbook.md docs/metrics.md docs/security.md docs/storage-format.md server/README.md
                         server/place/data/LICENSES.md)

install(TARGETS relmap-frontend relmap-camera RUNTIME DESTINATION bin COMPONENT frontend)
install(TARGETS relmap-camera-1394 RUNTIME DESTINATION lib/relmap COMPONENT frontend)
install(FILES ${CMAKE_SOURCE_DIR}/tools/99-relmap-cameras.rules DESTINATION lib/udev/rules.d COMPONENT frontend)
install(FILES ${CMAKE_SOURCE_DIR}/tools/ops/frontend-cart.conf DESTINATION share/relmap COMPONENT frontend)
relmap_install_text(frontend ${systemd}/relmap-frontend@.service lib/systemd/system)
install(FILES ${CMAKE_SOURCE_DIR}/${systemd}/relmap-frontend.sysusers DESTINATION lib/sysusers.d
        RENAME relmap-frontend.conf COMPONENT frontend)
relmap_install_documents(frontend docs/cameras.md docs/frontend.md)

install(TARGETS relmap-console RUNTIME DESTINATION bin COMPONENT console)
install(FILES ${CMAKE_SOURCE_DIR}/tools/ops/console.conf DESTINATION share/relmap COMPONENT console)
relmap_install_text(console ${systemd}/relmap-console.service lib/systemd/system)
install(FILES ${CMAKE_SOURCE_DIR}/${systemd}/relmap-console.sysusers DESTINATION lib/sysusers.d
        RENAME relmap-console.conf COMPONENT console)
relmap_install_documents(console docs/console.md)

install(TARGETS relmap relmap-admin relmap-vocab relmap-sim RUNTIME DESTINATION bin COMPONENT tools)
relmap_install_documents(tools README.md CHANGELOG.md LICENSES.md docs/glossary.md)

# The client and all that it stands on, as one archive.
set(parts relmap_client relmap_wire relmap_wire_generated relmap_access relmap_linear relmap_proto)
list(TRANSFORM parts REPLACE "(.+)" "$<TARGET_OBJECTS:\\1>" OUTPUT_VARIABLE objects)
add_library(relmap_client_archive STATIC ${objects})
set_target_properties(relmap_client_archive PROPERTIES OUTPUT_NAME relmap-client LINKER_LANGUAGE CXX)
install(TARGETS relmap_client_archive ARCHIVE DESTINATION lib COMPONENT dev)
install(CODE "include(${CMAKE_SOURCE_DIR}/cmake/installed/install_headers.cmake)
relmap_install_headers([==[${CMAKE_SOURCE_DIR}]==] client/relmap_client.h)" COMPONENT dev)
configure_package_config_file(cmake/installed/relmapConfig.cmake.in ${CMAKE_BINARY_DIR}/installed/relmapConfig.cmake
                              INSTALL_DESTINATION lib/cmake/relmap)
write_basic_package_version_file(${CMAKE_BINARY_DIR}/installed/relmapConfigVersion.cmake
                                 COMPATIBILITY SameMinorVersion)  # as long as versions begin with 0
install(FILES ${CMAKE_BINARY_DIR}/installed/relmapConfig.cmake ${CMAKE_BINARY_DIR}/installed/relmapConfigVersion.cmake
        DESTINATION lib/cmake/relmap COMPONENT dev)
configure_file(cmake/installed/relmap-client.pc.in ${CMAKE_BINARY_DIR}/installed/relmap-client.pc @ONLY)
install(FILES ${CMAKE_BINARY_DIR}/installed/relmap-client.pc DESTINATION lib/pkgconfig COMPONENT dev)
file(GLOB protos ${CMAKE_SOURCE_DIR}/proto/relmap/v1/*.proto)
install(FILES ${protos} DESTINATION share/relmap/proto/relmap/v1 COMPONENT dev)
file(GLOB lcm_types ${CMAKE_SOURCE_DIR}/proto/lcm/*.lcm)
install(FILES ${lcm_types} DESTINATION share/relmap/lcm COMPONENT dev)
relmap_install_documents(dev client/README.md docs/protocol.md)
install(FILES ${CMAKE_SOURCE_DIR}/tests/installed/where_am_i.cc ${CMAKE_SOURCE_DIR}/tests/installed/CMakeLists.txt
        DESTINATION share/doc/relmap/examples COMPONENT dev)

install(DIRECTORY client/python/relmap DESTINATION lib/python3/dist-packages COMPONENT python
        FILES_MATCHING PATTERN "*.py" PATTERN "*.pyi" PATTERN py.typed PATTERN __pycache__ EXCLUDE)
configure_file(client/python/METADATA.in ${CMAKE_BINARY_DIR}/installed/METADATA @ONLY)
install(FILES ${CMAKE_BINARY_DIR}/installed/METADATA DESTINATION lib/python3/dist-packages/relmap-${PROJECT_VERSION}.dist-info
        COMPONENT python)
relmap_install_documents(python docs/python.md)
foreach(file report_of_a_day judge_closures map_from_nothing)
  install(FILES ${CMAKE_SOURCE_DIR}/client/python/notebooks/${file}.ipynb
          DESTINATION share/doc/python3-relmap/examples COMPONENT python)
endforeach()
install(FILES ${CMAKE_SOURCE_DIR}/client/python/notebooks/points_world.py
        DESTINATION share/doc/python3-relmap/examples COMPONENT python)

add_custom_target(relmap_installed DEPENDS relmapd relmap-frontend relmap-camera relmap-camera-1394 relmap relmap-admin
                  relmap-vocab relmap-sim relmap-console relmap_client_archive)
if(TARGET relmap_manuals)
  add_dependencies(relmap_installed relmap_manuals)
endif()
