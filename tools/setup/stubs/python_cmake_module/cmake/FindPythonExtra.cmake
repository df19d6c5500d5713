find_package(Python3 REQUIRED COMPONENTS Interpreter Development)
set(PythonExtra_FOUND TRUE)
set(PythonExtra_INCLUDE_DIRS "${Python3_INCLUDE_DIRS}")
set(PythonExtra_LIBRARIES "${Python3_LIBRARIES}")
