# The page of knap view: its own files, and what it uses of three.js, side by side in <build>/viewer.
if(KNAP_SANITIZE)
    set(NPM NPM-NOTFOUND)  # nothing of it is compiled
else()
    find_program(NPM npm)
endif()
if(NPM)
    set(found_npm ON)
else()
    set(found_npm OFF)
endif()
option(KNAP_VIEWER "Build the page of knap view; takes npm and its registry" ${found_npm})
if(NOT KNAP_VIEWER)
    message(STATUS "Viewer: not built (${NPM}); knap view will say so")
    return()
endif()
message(STATUS "Viewer: with ${NPM}")

set(from ${CMAKE_CURRENT_LIST_DIR}/viewer)
set(page ${PROJECT_BINARY_DIR}/viewer)
set(modules ${PROJECT_BINARY_DIR}/viewer_npm)
set(page_files index.html style.css archive.mjs choose_tiles.mjs cloud.mjs colour_map.mjs colour_modes.mjs eye_dome.mjs
               main.mjs pane.mjs panel.mjs point_material.mjs stored_values.mjs tile_reader.mjs)
# As three.js has them: the page names these places.
set(three_files LICENSE build/three.core.js build/three.module.js examples/jsm/controls/OrbitControls.js
                examples/jsm/loaders/DRACOLoader.js examples/jsm/libs/draco/README.md
                examples/jsm/libs/draco/draco_decoder.js examples/jsm/libs/draco/draco_decoder.wasm
                examples/jsm/libs/draco/draco_wasm_wrapper.js)

set(three_stamp ${modules}/three.stamp)
set(copy_three "")
foreach(file IN LISTS three_files)
    list(APPEND copy_three COMMAND ${CMAKE_COMMAND} -E copy ${modules}/node_modules/three/${file} ${page}/vendor/three/${file})
endforeach()
add_custom_command(OUTPUT ${three_stamp}
                   COMMAND ${CMAKE_COMMAND} -D NPM=${NPM} -D FROM=${from} -D INTO=${modules}
                           -P ${CMAKE_CURRENT_LIST_DIR}/npm_install.cmake
                   COMMAND ${CMAKE_COMMAND} -E rm -rf ${page}/vendor
                   ${copy_three}
                   COMMAND ${CMAKE_COMMAND} -E touch ${three_stamp}
                   DEPENDS ${from}/package.json ${from}/package-lock.json ${from}/.npmrc
                           ${CMAKE_CURRENT_LIST_DIR}/npm_install.cmake ${CMAKE_CURRENT_LIST_FILE}
                   COMMENT "Installing what the viewer's page uses" VERBATIM)
set(pages "")
foreach(file IN LISTS page_files)
    add_custom_command(OUTPUT ${page}/${file}
                       COMMAND ${CMAKE_COMMAND} -E copy ${from}/${file} ${page}/${file}
                       DEPENDS ${from}/${file} VERBATIM)
    list(APPEND pages ${page}/${file})
endforeach()
add_custom_target(viewer ALL DEPENDS ${three_stamp} ${pages})

install(DIRECTORY ${page}/ DESTINATION ${CMAKE_INSTALL_DATADIR}/knap/viewer COMPONENT program)
