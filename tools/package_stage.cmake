# Run by cpack between installing and packing: what Debian asks of a package, and a plain
# cmake --install leaves alone. A folder a component under CPACK_TEMPORARY_INSTALL_DIRECTORY.
find_program(GZIP gzip REQUIRED)
string(TIMESTAMP date "%a, %d %b %Y %H:%M:%S +0000" UTC)  # of SOURCE_DATE_EPOCH, where that is set

foreach(component IN LISTS CPACK_COMPONENTS_ALL)
    string(TOUPPER ${component} upper)
    set(name ${CPACK_DEBIAN_${upper}_PACKAGE_NAME})
    set(root ${CPACK_TEMPORARY_INSTALL_DIRECTORY}/${component}/usr)
    set(doc ${root}/share/doc/${name})
    set(licence Apache-2.0)
    if(component STREQUAL front_mesh)
        set(licence GPL-3)
    endif()
    file(WRITE ${doc}/copyright
"Format: https://www.debian.org/doc/packaging-manuals/copyright-format/1.0/
Upstream-Name: knap

Files: *
Copyright: the knap authors
License: ${licence}
 On Debian systems the text of this licence is in
 /usr/share/common-licenses/${licence}.
")
    set(three ${root}/share/knap/viewer/vendor/three)
    if(EXISTS ${three})
        file(READ ${three}/LICENSE expat)
        string(STRIP "${expat}" expat)
        string(REPLACE "\n\n" "\n.\n" expat "${expat}")
        string(REPLACE "\n" "\n " expat "${expat}")
        file(APPEND ${doc}/copyright
"
Files: usr/share/knap/viewer/vendor/three/*
Copyright: the three.js authors
License: Expat
 ${expat}

Files: usr/share/knap/viewer/vendor/three/examples/jsm/libs/draco/*
Copyright: the Draco authors
License: Apache-2.0
 On Debian systems the text of this licence is in
 /usr/share/common-licenses/Apache-2.0.
")
    endif()
    file(WRITE ${doc}/changelog.Debian
"knap (${CPACK_PACKAGE_VERSION}-${CPACK_DEBIAN_PACKAGE_RELEASE}) unstable; urgency=medium

  * What has changed is in changelog.gz.

 -- ${CPACK_PACKAGE_CONTACT}  ${date}
")
    if(EXISTS ${doc}/CHANGELOG.md)
        file(RENAME ${doc}/CHANGELOG.md ${doc}/changelog)
    else()
        file(COPY_FILE ${CMAKE_CURRENT_LIST_DIR}/../CHANGELOG.md ${doc}/changelog)
    endif()
    file(GLOB_RECURSE to_pack ${root}/share/man/*.1)
    execute_process(COMMAND ${GZIP} -9n ${to_pack} ${doc}/changelog ${doc}/changelog.Debian COMMAND_ERROR_IS_FATAL ANY)
endforeach()
