# cmake -D NPM=... -D FROM=... -D INTO=... -P tools/npm_install.cmake
# Installs the npm packages that FROM/package-lock.json pins into INTO/node_modules. None of their scripts is run.
file(MAKE_DIRECTORY ${INTO})
file(COPY ${FROM}/package.json ${FROM}/package-lock.json ${FROM}/.npmrc DESTINATION ${INTO})
execute_process(COMMAND ${NPM} ci --ignore-scripts --no-audit --no-fund --loglevel=error
                WORKING_DIRECTORY ${INTO} OUTPUT_QUIET ERROR_VARIABLE said RESULT_VARIABLE status)
if(NOT status EQUAL 0)
    message(FATAL_ERROR "npm cannot install what ${FROM}/package-lock.json names (-D KNAP_VIEWER=OFF builds without):\n${said}")
endif()
