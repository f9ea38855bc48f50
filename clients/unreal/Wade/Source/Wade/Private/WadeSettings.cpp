#include "WadeSettings.h"

FName UWadeSettings::GetCategoryName() const
{
	return FName(TEXT("Plugins"));
}

FString UWadeSettings::Address() const
{
	switch (Transport)
	{
	case EWadeTransport::Tcp:
		return Endpoint;
	case EWadeTransport::UnixSocket:
		return TEXT("unix:") + SocketPath;
	default:
		return TEXT("shm:") + Namespace;
	}
}
