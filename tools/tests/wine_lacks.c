/* wine_lacks.c: CM_MapCrToWin32Err of cfgmgr32.dll, which pyserial's list of ports asks for, and which Wine 8 does not
 * have. The other two are passed on, since this library takes the place of Wine's own.
 */
#include <windows.h>

#include <cfgmgr32.h>

__declspec(dllexport) DWORD WINAPI CM_MapCrToWin32Err(CONFIGRET result, DWORD otherwise) {
  return result == CR_SUCCESS ? ERROR_SUCCESS : otherwise;
}

static FARPROC of_setup(const char *name) { return GetProcAddress(LoadLibraryW(L"setupapi"), name); }

__declspec(dllexport) CONFIGRET WINAPI CM_Get_Parent(PDEVINST parent, DEVINST child, ULONG flags) {
  return ((CONFIGRET(WINAPI *)(PDEVINST, DEVINST, ULONG))of_setup("CM_Get_Parent"))(parent, child, flags);
}

__declspec(dllexport) CONFIGRET WINAPI CM_Get_Device_IDW(DEVINST device, PWSTR name, ULONG size, ULONG flags) {
  return ((CONFIGRET(WINAPI *)(DEVINST, PWSTR, ULONG, ULONG))of_setup("CM_Get_Device_IDW"))(device, name, size, flags);
}
