// Project Settings > Plugins > Wade: where the server is, and how long a physics step may wait for it.

#pragma once

#include "CoreMinimal.h"
#include "Engine/DeveloperSettings.h"
#include "WadeSettings.generated.h"

/** How the server is reached. */
UENUM()
enum class EWadeTransport : uint8
{
	/** Shared memory on this machine: the fastest; where the server runs. */
	SharedMemory,
	/** gRPC over TCP: another machine, or Windows. */
	Tcp,
	/** gRPC over a Unix socket. */
	UnixSocket,
};

UCLASS(Config = Game, DefaultConfig, meta = (DisplayName = "Wade"))
class WADE_API UWadeSettings : public UDeveloperSettings
{
	GENERATED_BODY()

public:
	UPROPERTY(EditAnywhere, Config, Category = "Server")
	EWadeTransport Transport = EWadeTransport::SharedMemory;

	/** The server's shm.namespace. */
	UPROPERTY(EditAnywhere, Config, Category = "Server", meta = (EditCondition = "Transport == EWadeTransport::SharedMemory"))
	FString Namespace = TEXT("wade");

	/** Host and port of gRPC, with https:// before them where the server speaks TLS; also asked for a vehicle's dimensions in the editor, whatever the transport. */
	UPROPERTY(EditAnywhere, Config, Category = "Server")
	FString Endpoint = TEXT("127.0.0.1:50051");

	/** Path of the Unix socket. */
	UPROPERTY(EditAnywhere, Config, Category = "Server", meta = (EditCondition = "Transport == EWadeTransport::UnixSocket"))
	FString SocketPath = TEXT("/tmp/wade.sock");

	/** For the endpoint: absolute path of a PEM file of the authorities whose servers are believed. Empty: those of the system. */
	UPROPERTY(EditAnywhere, Config, Category = "Security")
	FString CaFile;

	/** For the endpoint: absolute path of a PEM file of this client's certificate, with those between it and its authority. Empty:
	 *  none. */
	UPROPERTY(EditAnywhere, Config, Category = "Security")
	FString CertificateFile;

	/** Absolute path of the PEM file of the certificate's private key. */
	UPROPERTY(EditAnywhere, Config, Category = "Security")
	FString KeyFile;

	/** For the endpoint: absolute path of a file with a token, as `wade token` prints it. Empty: none. */
	UPROPERTY(EditAnywhere, Config, Category = "Security")
	FString TokenFile;

	/** Polls for an answer instead of sleeping: faster by the time it takes to wake up, for the price of a core. */
	UPROPERTY(EditAnywhere, Config, Category = "Server", meta = (EditCondition = "Transport == EWadeTransport::SharedMemory"))
	bool bPollForAnswers = false;

	/** Most time that a vehicle may wait for its answers in one physics step [us]; vehicles of one name pool theirs. 0 never waits:
	 *  answers are a step late. */
	UPROPERTY(EditAnywhere, Config, Category = "Pacing", meta = (ClampMin = "0", ClampMax = "10000"))
	int32 BudgetMicroseconds = 300;

	/** Longest time over which one answer counts [ms]; a longer physics step asks several times. */
	UPROPERTY(EditAnywhere, Config, Category = "Pacing", meta = (ClampMin = "1", ClampMax = "50"))
	float SubstepMilliseconds = 8.4f;

	virtual FName GetCategoryName() const override;

	/** The address as wade_options wants it. */
	FString Address() const;
};
