# Installs BUILD under FOLDER/prefix, builds PROGRAM against that installation only, and compares its output with the
# answer from INPUTS.
file(REMOVE_RECURSE ${FOLDER})
file(MAKE_DIRECTORY ${FOLDER})

function(run)
    execute_process(COMMAND ${ARGV} COMMAND_ERROR_IS_FATAL ANY)
endfunction()

run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${FOLDER}/prefix)
run(${CMAKE_COMMAND} -S ${PROGRAM} -B ${FOLDER}/build -G ${GENERATOR}
    -D CMAKE_CXX_COMPILER=${COMPILER} -D CMAKE_CXX_FLAGS=${FLAGS} -D CMAKE_BUILD_TYPE=Release
    -D CMAKE_PREFIX_PATH=${FOLDER}/prefix -D CMAKE_FIND_USE_PACKAGE_REGISTRY=OFF)
run(${CMAKE_COMMAND} --build ${FOLDER}/build)
run(${INPUTS} ${FOLDER})
foreach(bounds boxes exact)
    execute_process(COMMAND ${FOLDER}/build/touching torus.nbd torus.f32 bar.nbd bar.f32 ${bounds}
        WORKING_DIRECTORY ${FOLDER} OUTPUT_FILE ${bounds}.csv COMMAND_ERROR_IS_FATAL ANY)
    run(${CMAKE_COMMAND} -E compare_files ${FOLDER}/${bounds}.csv ${FOLDER}/expected.csv)
endforeach()
