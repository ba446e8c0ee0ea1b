# Everything relmap stands on, as imported targets; all Debian 12 packages (tools/setup).
find_package(Threads REQUIRED)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(OpenCV 4.5 REQUIRED COMPONENTS core imgproc imgcodecs features2d calib3d videoio)
find_package(JPEG REQUIRED)
find_package(ZLIB REQUIRED)
find_package(Boost 1.74 REQUIRED)  # headers only: Beast and Asio
find_package(OpenSSL 3 REQUIRED)
find_package(yaml-cpp REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(spdlog REQUIRED)
set(RELMAP_LOG spdlog::spdlog)
if(RELMAP_SANITIZE STREQUAL "thread")  # the library's own guards are unknown to it: two first messages look like a race
  set(RELMAP_LOG spdlog::spdlog_header_only)
endif()
find_package(CLI11 REQUIRED)
find_package(Ceres 2.1 REQUIRED)  # what relmap-bench compares with
find_package(PkgConfig REQUIRED)
pkg_check_modules(LIBUSB REQUIRED IMPORTED_TARGET libusb-1.0)
pkg_check_modules(EXIF REQUIRED IMPORTED_TARGET libexif)
pkg_check_modules(DC1394 REQUIRED IMPORTED_TARGET libdc1394-2)
pkg_check_modules(UMOCKDEV REQUIRED IMPORTED_TARGET umockdev-1.0)  # the simulated camera of tests

# malloc() for programs that live long; the sanitizers bring their own.
add_library(relmap_allocator INTERFACE)
if(RELMAP_SERVERS AND NOT RELMAP_SANITIZE)
  pkg_check_modules(JEMALLOC REQUIRED IMPORTED_TARGET jemalloc)
  target_sources(relmap_allocator INTERFACE ${CMAKE_SOURCE_DIR}/server/allocator_settings.cc)
  target_link_libraries(relmap_allocator INTERFACE PkgConfig::JEMALLOC)
endif()

# OpenCV's variables as one target with SYSTEM headers.
add_library(relmap_opencv INTERFACE)
target_include_directories(relmap_opencv SYSTEM INTERFACE ${OpenCV_INCLUDE_DIRS})
target_link_libraries(relmap_opencv INTERFACE opencv_core opencv_imgproc opencv_imgcodecs opencv_features2d opencv_calib3d)

# CHOLMOD has no CMake package.
find_path(CHOLMOD_INCLUDE_DIR cholmod.h PATH_SUFFIXES suitesparse REQUIRED)
find_library(CHOLMOD_LIBRARY cholmod REQUIRED)
add_library(relmap_cholmod INTERFACE)
target_include_directories(relmap_cholmod SYSTEM INTERFACE ${CHOLMOD_INCLUDE_DIR})
target_link_libraries(relmap_cholmod INTERFACE ${CHOLMOD_LIBRARY})

if(RELMAP_SERVERS)
  find_package(Protobuf REQUIRED)  # module mode first: gRPC's config expects its targets
  find_package(gRPC REQUIRED)
  find_package(RocksDB REQUIRED)
  find_package(prometheus-cpp REQUIRED CONFIG)  # only its core, which writes the text format
  pkg_check_modules(LCM REQUIRED IMPORTED_TARGET lcm)
  find_program(LCM_GEN lcm-gen REQUIRED)
  find_program(GRPC_CPP_PLUGIN grpc_cpp_plugin REQUIRED)
endif()
