# The Debian packages that cpack makes: knap, the library and what programs are built with against it.
# tools/package is how to make them; CPACK_COMPONENTS_ALL=front_mesh makes the one that is under the GPL.
set(KNAP_PACKAGE_MAINTAINER "The knap authors" CACHE STRING "Maintainer of the packages: Name <address>")

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME knap)
set(CPACK_PACKAGE_VENDOR knap)
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "")  # each package has its own
set(CPACK_PACKAGE_CONTACT "${KNAP_PACKAGE_MAINTAINER}")
set(CPACK_RESOURCE_FILE_LICENSE ${PROJECT_SOURCE_DIR}/LICENSE)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENTS_ALL program library development)
set(CPACK_PRE_BUILD_SCRIPTS ${CMAKE_CURRENT_LIST_DIR}/package_stage.cmake)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE
                                                WORLD_READ WORLD_EXECUTE)

set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_ENABLE_COMPONENT_DEPENDS ON)

set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME knap)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SECTION science)
set(CPACK_COMPONENT_PROGRAM_DESCRIPTION "simplifies point clouds of any size, keeping their shape
knap keeps many points where a surface bends (ridges, edges, corners) and few
where it is flat, and writes the result as Draco. It works out of core, and
the result does not depend on memory or threads.")
set(soname ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
set(CPACK_DEBIAN_LIBRARY_PACKAGE_NAME libknap${soname})
set(CPACK_DEBIAN_LIBRARY_PACKAGE_SECTION libs)
# What a package of a program that uses the library depends on, and that the linker is to look again.
set(control ${PROJECT_BINARY_DIR}/control)
file(WRITE ${control}/shlibs "libknap ${soname} libknap${soname}\n")
file(WRITE ${control}/triggers "activate-noawait ldconfig\n")
set(CPACK_DEBIAN_LIBRARY_PACKAGE_CONTROL_EXTRA ${control}/shlibs ${control}/triggers)
set(CPACK_COMPONENT_LIBRARY_DESCRIPTION "simplification of point clouds of any size - shared library
knap keeps the points of a cloud that carry its shape. This is the library
behind the program, for clouds in memory and for archives out of core.")

set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libknap-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_COMPONENT_DEVELOPMENT_DEPENDS library)
set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION "simplification of point clouds of any size - development files
Headers, CMake and pkg-config files of libknap. Programs that use it need
none of the libraries that it is made with.")

set(CPACK_DEBIAN_FRONT_MESH_PACKAGE_NAME knap-front-mesh)
set(CPACK_DEBIAN_FRONT_MESH_PACKAGE_SECTION science)
set(CPACK_COMPONENT_FRONT_MESH_DEPENDS program)
set(CPACK_COMPONENT_FRONT_MESH_DESCRIPTION "measures simplified point clouds by a mesh
What knap evaluate --surface mesh runs: CGAL's advancing front through the
points that were kept. Under the GPL, unlike knap itself.")

include(CPack)
